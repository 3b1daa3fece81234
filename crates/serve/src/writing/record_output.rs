//! Where what is recorded goes: a file, viewers while it happens, or both.

use std::time::Duration;

use foxglove::Server;
use recording::Batch;
use words::failure::Failure;

use super::record_file::RecordFile;

/// A file, viewers, or both: each gets the same batches.
#[derive(Default)]
pub struct RecordOutput {
    /// The file, if one is asked for.
    pub file: Option<RecordFile>,
    /// The server for viewers, if one is asked for.
    pub viewers: Option<Server>,
}

impl RecordOutput {
    /// Takes a batch. Viewers are never waited for; the file as [`RecordFile::write`] says.
    pub fn write(&mut self, batch: Batch) {
        match (&self.viewers, &mut self.file) {
            (Some(viewers), Some(file)) => {
                if viewers.is_watched() {
                    viewers.show(batch.clone());
                }
                file.write(batch);
            }
            (Some(viewers), None) => viewers.show(batch),
            (None, Some(file)) => file.write(batch),
            (None, None) => {}
        }
    }

    /// Waits until everything is written, at most for `patience`, and until viewers that read have what they were sent.
    ///
    /// # Errors
    /// The file is not whole.
    pub fn finish(self, patience: Duration) -> Result<(), Failure> {
        self.viewers.into_iter().for_each(Server::finish);
        self.file.map_or(Ok(()), |file| file.finish(patience))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use foxglove::Options;
    use futures_util::{SinkExt, StreamExt};
    use recording::{Channels, Kind, Record, columns_of_drives};
    use scenario::{Runner, Scenario};
    use sim::Place;
    use sim::recorder::{Channel, Recorder, Signal};
    use tokio_tungstenite::connect_async;
    use tokio_tungstenite::tungstenite::Message;
    use tokio_tungstenite::tungstenite::client::IntoClientRequest;

    use super::*;
    use crate::messages::Messages;
    use crate::writing::Pace;

    /// Bytes before the values of a message: opcode, subscription, time, and the representation of CDR.
    const HEAD: usize = 1 + 4 + 8 + 4;

    /// A drive that turns for a second, in virtual time.
    fn runner() -> Runner {
        let text = "end = \"1s\"\n[machine]\ntiming = \"ideal\"\ndrive = [{ model = \"zlac8030l\", node = 4 }]\n\
                    [[host]]\ndo = [\"4 write 2000 0\", \"4 velocity 60rpm\"]\n";
        let scenario = Scenario::parse(text, Path::new("")).expect("a scenario");
        let mut runner = Runner::new(&scenario, None).expect("a machine");
        let channels = Signal::ALL.map(|signal| Channel { place: Place::node(4), signal });
        runner.world_mut().start_recording(Recorder::new(Duration::from_millis(1), channels));
        runner.world_mut().watch(true);
        runner.keep();
        runner
    }

    #[tokio::test]
    async fn a_viewer_gets_the_values_that_the_file_gets() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = scratch.path();
        let path = folder.join("run.mcap");
        let columns = columns_of_drives([Place::node(4)]);
        let file = crate::files::create_record(&path, Kind::Mcap).expect("a file");
        let record = Record::begin(Kind::Mcap, Box::new(file), &columns).expect("begun");
        let server = Server::start("127.0.0.1:0", Options::default(), Channels::of(&columns)).expect("a free port");
        let mut request = format!("ws://{}", server.address()).into_client_request().expect("an address");
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.websocket.v1".parse().expect("a value"));
        let (mut viewer, _) = connect_async(request).await.expect("let in");
        let all = r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":0},{"id":2,"channelId":2}]}"#;
        viewer.send(Message::text(all)).await.expect("sent");
        while !server.is_watched() {
            tokio::task::yield_now().await;
        }
        let file = RecordFile::start(record, Pace::Free, Messages::silent());
        let mut output = RecordOutput { file: Some(file), viewers: Some(server) };
        let mut runner = runner();
        while runner.step() {}
        let kept = runner.take_kept();
        let batch = Batch::of_world(runner.world_mut().take_recorded(), kept.frames, &kept.events);
        let frames = batch.frames.clone();
        let mut left = frames.len() + batch.samples();
        output.write(batch);
        let mut seen: BTreeMap<u32, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
        while left > 0 {
            match viewer.next().await.expect("open").expect("a message") {
                Message::Binary(data) if data[0] == 1 => {
                    let subscription = u32::from_le_bytes(data[1..5].try_into().expect("four bytes"));
                    let nanos = u64::from_le_bytes(data[5..13].try_into().expect("eight bytes"));
                    seen.entry(subscription).or_default().push((nanos, data[HEAD..].to_vec()));
                    left -= 1;
                }
                // That something was left out.
                Message::Text(text) => assert!(!text.contains("\"status\""), "{text}"),
                _ => {}
            }
        }
        drop(viewer);
        output.finish(Duration::MAX).expect("whole");
        let bytes = std::fs::read(&path).expect("it is there");
        let recorded = recording::read(Kind::Mcap, &bytes).expect("a record");
        let moved = recorded.series.iter().find(|series| series.column.signal == "velocity_rpm").expect("a speed");
        assert!(moved.points.len() > 900 && moved.points.iter().any(|(_, speed)| *speed > 50.0));
        let rows = &seen[&2];
        for series in &recorded.series {
            let field =
                columns.iter().position(|column| column.name() == series.column.name()).expect("it was asked for");
            let value = |data: &[u8]| f64::from_le_bytes(data[field * 8..][..8].try_into().expect("eight bytes"));
            let live = rows.iter().map(|(nanos, data)| (*nanos, value(data).to_bits()));
            let filed = series.points.iter().map(|(at, value)| ((at * 1e9).round() as u64, value.to_bits()));
            assert!(live.eq(filed), "{}", series.column.name());
        }
        let times: Vec<u64> = seen[&0].iter().map(|(nanos, _)| *nanos).collect();
        assert!(frames.len() > 1 && times.iter().copied().eq(frames.iter().map(|(at, _)| at.as_nanos())));
    }
}
