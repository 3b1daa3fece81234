//! The other end of a control connection: what `world` and `events` talk to a running simulator through.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::TcpStream;
#[cfg(unix)]
use std::os::unix::net::UnixStream;
use std::time::Duration;

use canopen::NodeId;
use host::control::{ControlAddress, ERROR_KINDS};
use serde_json::{Value, json};

use crate::failure::Failure;
use console::status::Status;

/// How long an answer is waited for.
const PATIENCE: Duration = Duration::from_secs(10);

/// Where the simulator is.
#[derive(Debug, clap::Args)]
pub(crate) struct ControlArgs {
    /// Control connection of a running simulator, as its `ready` line names it: HOST:PORT or the path of a socket
    #[arg(long, value_name = "PLACE", env = "FERRODRIVE_CONTROL")]
    control: Option<ControlAddress>,
    /// Token of a simulator on another machine
    #[arg(long, value_name = "TOKEN", env = "FERRODRIVE_CONTROL_TOKEN", hide_env_values = true)]
    control_token: Option<String>,
}

/// A connection.
pub(crate) struct ControlClient {
    reader: BufReader<ControlSocket>,
    place: ControlAddress,
    asked: u64,
    /// The drives of the simulator, as reported at the start.
    nodes: Value,
}

enum ControlSocket {
    Tcp(TcpStream),
    #[cfg(unix)]
    Unix(UnixStream),
}

impl ControlArgs {
    /// Of this place, without a token.
    #[cfg(test)]
    pub(crate) const fn of(place: ControlAddress) -> Self {
        Self { control: Some(place), control_token: None }
    }

    /// A simulator is named.
    pub(crate) const fn is_given(&self) -> bool {
        self.control.is_some()
    }

    /// Connects, and gives the token if there is one.
    pub(crate) fn connect(&self) -> Result<ControlClient, Failure> {
        let place = self.control.clone().ok_or_else(|| {
            Failure::usage("no control connection given")
                .because("world commands and events go through the control connection of a running simulator")
                .next("start it with `ferrodrive sim --control 127.0.0.1:0 ..`, and give what its ready line names: --control HOST:PORT, or FERRODRIVE_CONTROL")
        })?;
        let socket = ControlSocket::connect(&place).map_err(|error| {
            Failure::new(format!("cannot reach {place}"))
                .because(error)
                .of_kind("control")
                .next("check that a simulator runs with --control, and that its ready line names this address")
        })?;
        let mut client = ControlClient { reader: BufReader::new(socket), place, asked: 0, nodes: Value::Null };
        client.wait_at_most(Some(PATIENCE))?;
        let name = format!("ferrodrive {}", std::process::id());
        let mut answer = client.ask(json!({ "request": "hello", "token": self.control_token, "name": name }))?;
        client.nodes = answer["nodes"].take();
        Ok(client)
    }
}

impl ControlClient {
    /// The numbers of the drives that are there.
    pub(crate) fn nodes(&self) -> Vec<u64> {
        self.nodes.as_array().into_iter().flatten().filter_map(|node| node["node"].as_u64()).collect()
    }

    /// How long the next lines are waited for; `None` for ever.
    pub(crate) fn wait_at_most(&mut self, patience: Option<Duration>) -> Result<(), Failure> {
        self.reader.get_ref().set_patience(patience).map_err(|error| self.lost(&error))
    }

    /// Asks, and waits for the answer; what else comes meanwhile is passed over.
    pub(crate) fn ask(&mut self, mut request: Value) -> Result<Value, Failure> {
        self.asked += 1;
        request["id"] = json!(self.asked);
        writeln!(self.reader.get_mut(), "{request}").map_err(|error| self.lost(&error))?;
        loop {
            let mut line = self.next()?.ok_or_else(|| self.lost(&"it has closed the connection"))?;
            // What came before it was asked has no mark.
            if line["id"] == self.asked || line["id"].is_null() && line["ok"] == false {
                if let Some(fields) = line.as_object_mut() {
                    fields.remove("id");
                }
                return if line["ok"] == true { Ok(line) } else { Err(refusal(&line["error"])) };
            }
        }
    }

    /// The next line; `None` when there are no more.
    pub(crate) fn next(&mut self) -> Result<Option<Value>, Failure> {
        let mut line = String::new();
        match self.reader.read_line(&mut line) {
            Ok(0) => Ok(None),
            Ok(_) => serde_json::from_str(&line).map(Some).map_err(|error| {
                Failure::new(format!("{} speaks no protocol of a simulator", self.place))
                    .because(error)
                    .of_kind("control")
            }),
            Err(error) => Err(self.lost(&error)),
        }
    }

    fn lost(&self, why: &dyn std::fmt::Display) -> Failure {
        Failure::new(format!("no answer from {}", self.place))
            .because(why)
            .of_kind("control")
            .next("is the simulator still running?")
    }
}

/// What the simulator refuses, as a failure of this command.
fn refusal(error: &Value) -> Failure {
    let text = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
    let kind = ERROR_KINDS.into_iter().find(|kind| error["kind"] == *kind).unwrap_or("refused");
    let mut failure = Failure::new(text("message")).of_kind(kind);
    if kind == "usage" {
        failure.status = Status::Usage;
    }
    if kind == "token" {
        failure = failure
            .next("give --control-token, or FERRODRIVE_CONTROL_TOKEN: the simulator names it on its standard error");
    } else if !text("next").is_empty() {
        failure = failure.next(text("next"));
    }
    let node = error["node"].as_u64().and_then(|node| NodeId::new(u8::try_from(node).ok()?));
    node.into_iter().fold(failure, Failure::at_node)
}

impl ControlSocket {
    fn connect(place: &ControlAddress) -> io::Result<Self> {
        match place {
            ControlAddress::Tcp(address) => {
                let stream = TcpStream::connect(address)?;
                stream.set_nodelay(true)?;
                Ok(Self::Tcp(stream))
            }
            #[cfg(unix)]
            ControlAddress::Unix(path) => UnixStream::connect(path).map(Self::Unix),
            #[cfg(not(unix))]
            ControlAddress::Unix(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    fn set_patience(&self, patience: Option<Duration>) -> io::Result<()> {
        match self {
            Self::Tcp(stream) => stream.set_read_timeout(patience),
            #[cfg(unix)]
            Self::Unix(stream) => stream.set_read_timeout(patience),
        }
    }
}

impl Read for ControlSocket {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.read(bytes),
            #[cfg(unix)]
            Self::Unix(stream) => stream.read(bytes),
        }
    }
}

impl Write for ControlSocket {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.write(bytes),
            #[cfg(unix)]
            Self::Unix(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
