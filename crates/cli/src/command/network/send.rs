//! `ferrodrive send`: frames as they are typed.

use can::Frame;
use serde::Serialize;

use crate::command::repeat::{Repeat, Ticker};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;

/// Send frames as they are
///
/// Their effect is not checked: a frame may start a motor. With --verbose the answers on the bus are shown.
#[derive(Debug, clap::Args)]
#[command(after_help = "Frames are written as by candump and cansend, in hexadecimal:\n  \
    ferrodrive send 604#4041600000000000 -v   # read 6041h of node 4 by SDO\n  \
    ferrodrive send 000#0104 080#             # NMT start for node 4, then SYNC\n  \
    ferrodrive send 184#R8                    # a remote frame of 8 bytes\n  \
    ferrodrive send 123#11.22.33 --every 10ms --count 100")]
pub(crate) struct Send {
    /// ID#DATA, ID#R or ID#RLENGTH; an identifier of 8 digits is an extended one
    #[arg(value_name = "FRAME", required = true, value_parser = frame)]
    frames: Vec<Frame>,
    #[command(flatten)]
    repeat: Repeat,
}

fn frame(text: &str) -> Result<Frame, String> {
    let expected = "expected a frame such as 604#4041600000000000, 123#R or 1ABCDE00#11.22";
    text.parse().map_err(|error| format!("{error}; {expected}"))
}

/// What was sent.
#[derive(Debug, Serialize)]
pub(crate) struct SendReport {
    /// The frames, in candump form.
    frames: Vec<String>,
    /// How many went out altogether.
    sent: u64,
}

impl Send {
    /// Sends them, and leaves the bus a moment to answer.
    pub(crate) async fn run(&self, context: &Context) -> Result<SendReport, Failure> {
        let times = self.repeat.times(context)?;
        let mut pace = Ticker::new(&context.network, self.repeat.every.unwrap_or_default());
        let mut done = 0;
        while times.is_none_or(|times| done < times) {
            pace.wait().await;
            for frame in &self.frames {
                context.network.transmit(*frame);
            }
            done += 1;
            context.progress.show(format!("sent {done} times"));
        }
        context.settle().await;
        Ok(SendReport {
            frames: self.frames.iter().map(Frame::to_string).collect(),
            sent: done * self.frames.len() as u64,
        })
    }
}

impl Report for SendReport {
    fn text(&self, _: Paint) -> String {
        let unit = if self.sent == 1 { "frame" } else { "frames" };
        format!("{} {unit} sent: {}", self.sent, self.frames.join(" "))
    }
}
