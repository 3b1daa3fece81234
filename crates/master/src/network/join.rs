use core::future::{Future, poll_fn};
use core::pin::Pin;
use core::task::Poll;

/// Waits for all futures at once and gives their results in the same order.
///
/// Every wake-up polls all that are still pending: meant for the 127 nodes of a network, not for thousands.
pub async fn join_all<F: Future>(futures: impl IntoIterator<Item = F>) -> Vec<F::Output> {
    let mut entries: Vec<_> = futures.into_iter().map(|future| Entry::Running(Box::pin(future))).collect();
    poll_fn(|context| {
        let mut pending = false;
        for entry in &mut entries {
            if let Entry::Running(future) = entry {
                match future.as_mut().poll(context) {
                    Poll::Ready(output) => *entry = Entry::Done(output),
                    Poll::Pending => pending = true,
                }
            }
        }
        if pending { Poll::Pending } else { Poll::Ready(()) }
    })
    .await;
    entries.into_iter().filter_map(Entry::into_output).collect()
}

enum Entry<F: Future> {
    Running(Pin<Box<F>>),
    Done(F::Output),
}

impl<F: Future> Entry<F> {
    fn into_output(self) -> Option<F::Output> {
        match self {
            Self::Running(_) => None,
            Self::Done(output) => Some(output),
        }
    }
}
