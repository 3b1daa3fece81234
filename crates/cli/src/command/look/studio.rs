//! `ferrodrive studio`: the web front end to the bus.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io::Write;
use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

use can::Bitrate;
use canopen::NodeId;
use console::line::Reader;
use host::capture::WaysBack;
use host::{Host, Journals, Setting};
use machine::parameters::journal::Journal;
use recording::Channels;
use serde::Serialize;
use studio::{Access, AccessError, Password, Token};
use transport::BusSpec;
use words::document::read_text;

use crate::command::configure::params::journal::{Kept, default_path, note_kept};
use crate::command::network::gateway::address;
use crate::context::{Context, Restorer};
use crate::control_client::ControlArgs;
use crate::failure::Failure;
use crate::far_world;
use crate::output::{Format, Report, file_path};
use crate::recording::{HostViewers, ViewerOptions, interface_of};
use crate::served::{cannot_listen, listen};
use plot::Paint;

/// Show and move drives in the browser
///
/// Serves a page at the address in the first line of output. Any number of pages may watch; one has control, and hands
/// it over. What a page moves stops when the page closes or falls silent: a jog within 200 ms. Every page can stop
/// drives. Without --bus it serves a virtual machine whose time follows the clock.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive studio --open\n  ferrodrive --bus can0 studio\n  \
    ferrodrive --bus socketcand://HOST:29536/can0 studio --control HOST:7001\n  \
    ferrodrive --bus can0 studio --listen 0.0.0.0:8402 --password-file FILE")]
pub(crate) struct Studio {
    /// Address to listen at; port 0 takes a free one. One that other machines reach (not 127.0.0.1, [::1]) needs a
    /// password
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:8402", value_parser = address)]
    listen: String,
    /// File whose first line is the password for other machines, 12 characters or more
    ///
    /// Nothing is encrypted on its way, the password included: anyone who can listen on the network in between can read
    /// it, and anyone who has it can move the drives.
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// File with the access token, which is created if it does not exist, and is valid across launches
    ///
    /// Without it each launch has a token of its own, and pages that were open before have to be opened again by the
    /// address that is printed. Anyone who can read the file can move the drives: it is created for its owner alone.
    #[arg(long, value_name = "FILE", value_parser = file_path)]
    token_file: Option<PathBuf>,
    /// Name by which browsers may call this server, e.g. drives.local; may be repeated
    ///
    /// Without it only addresses of this machine and localhost are accepted: under the name of another site that leads
    /// here, the server could be used from any browser of this network.
    #[arg(long = "host", value_name = "NAME")]
    hosts: Vec<String>,
    /// Let the send window of the Trace view send frames that may set a drive in motion
    ///
    /// Controlwords, targets, RPDOs, NMT start, makers' objects: whatever is not known to be harmless. What such a frame moves is
    /// stopped with the page, as any motion of it, but not held to its speed limit.
    #[arg(long)]
    allow_motion: bool,
    /// Open the page in the browser of this machine
    #[arg(long)]
    open: bool,
    #[command(flatten)]
    control: ControlArgs,
    #[command(flatten)]
    viewers: ViewerOptions,
}

/// Where the studio is.
#[derive(Debug, Serialize)]
struct Ready {
    /// The address, with the token of this launch.
    studio: String,
}

impl Report for Ready {
    fn text(&self, _: Paint) -> String {
        format!("studio {}", self.studio)
    }
}

impl Studio {
    /// Serves until a signal ends it.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let password = self.password_file.as_deref().map(read_password).transpose()?;
        let (listener, address) = listen(&self.listen).await?;
        let access = Access::new(address, password).map_err(|error| refused(&error))?.with_hosts(self.hosts.clone());
        let access = match self.token_file.as_deref().map(kept_token).transpose()? {
            Some(token) => access.with_token(token),
            None => access,
        };
        if !address.ip().is_loopback() {
            let place = elsewhere(address);
            context.note(&format!(
                "from other machines: http://{place}/ with the password. Anyone who can reach it and has the password can move the drives, and nothing is encrypted on its way: \
                 keep it to a network of the machine's own"
            ));
        }
        let url = access.url();
        format.print(&Ready { studio: url.clone() }).map_err(Failure::of_stdout)?;
        context.traffic.listen();
        let mut setting = Setting { allow_motion: self.allow_motion, ..setting(context) };
        if self.control.is_given() && setting.world.is_none() {
            setting.world = Some(far_world::open(&self.control)?);
        }
        let (host, handle) = Host::new(context.network.clone(), setting);
        let viewers = HostViewers::new(self.viewers.start(Channels::exact(&[]), |note| context.note(note))?);
        let showing = viewers.serve(&handle);
        let app = studio::app(handle, Arc::new(access));
        tokio::select! {
            served = studio::serve(listener, app) => served.map_err(|error| cannot_listen(&self.listen, error)),
            // Not before the router is gone, which holds the handle.
            () = host.run(|| viewers.note(context.traffic.take())) => Ok(()),
            never = showing => match never {},
            never = self.keep_open(context, &url) => match never {},
        }
    }

    /// Opens the page if requested. The server continues even if that fails.
    async fn keep_open(&self, context: &Context, url: &str) -> Infallible {
        if self.open {
            open(context, url).await;
        }
        std::future::pending().await
    }
}

/// The address by which other machines reach this one: where it listens everywhere, the one that it would send from.
fn elsewhere(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        // An address for documentation (RFC 5737): a route is looked up, and nothing is sent.
        let asked = UdpSocket::bind("0.0.0.0:0").and_then(|socket| {
            socket.connect("192.0.2.1:9")?;
            socket.local_addr()
        });
        asked.into_iter().for_each(|own| address.set_ip(own.ip()));
    }
    address
}

/// What the host of a command gets at its start.
pub(in crate::command) fn setting(context: &Context) -> Setting {
    let ways_back = WaysBack::default();
    context.restore_at_end(Restorer::Captures(ways_back.clone()));
    Setting {
        ways_back,
        bus: context.bus().to_string(),
        bitrate: bitrate(context),
        timeout: context.timeout(),
        models: context.stated_models(),
        gears: context.gears(),
        groups: context.machine.as_ref().map(|machine| machine.groups.clone()).unwrap_or_default(),
        interface: interface_of(context.bus()).name().to_owned(),
        journals: journals(context),
        unix_zero: context.traffic.unix_zero(),
        world: context.world.clone(),
        console: Some(Arc::new(Reader)),
        wire: context.wire.clone(),
        allow_motion: false,
    }
}

/// Journals in the working folder, as `params apply` keeps them. A virtual bus of this command ends with it.
fn journals(context: &Context) -> Option<Arc<dyn Journals>> {
    if context.is_embedded() { None } else { Some(Arc::new(InFolder::default())) }
}

/// The journals of the transactions that are under way.
#[derive(Debug, Default)]
struct InFolder(Mutex<BTreeMap<NodeId, Kept>>);

impl Journals for InFolder {
    fn begin(&self, journal: &Journal) -> Result<(), String> {
        let kept =
            Kept::create(&default_path(journal.node), journal, note_kept).map_err(|failure| failure.to_string())?;
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(journal.node, kept);
        Ok(())
    }

    fn end(&self, node: NodeId) -> Result<(), String> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&node);
        kept.map_or(Ok(()), Kept::remove).map_err(|failure| failure.to_string())
    }
}

/// The bit rate, where the bus or the machine has it: a CAN interface of Linux does not.
pub(in crate::command) fn bitrate(context: &Context) -> Option<Bitrate> {
    match context.bus() {
        BusSpec::SlcanSerial { bitrate, .. } | BusSpec::SlcanTcp { bitrate, .. } => *bitrate,
        bus => {
            let said = context.machine.as_ref().and_then(|machine| machine.bitrate);
            // An embedded world has this one where its file says none.
            said.or(matches!(bus, BusSpec::Sim { .. }).then_some(Bitrate::K500))
        }
    }
}

fn read_password(path: &Path) -> Result<Password, Failure> {
    let text = read_text(path).map_err(|reason| {
        Failure::bad_file(format!("cannot read the password from {}", path.display()))
            .because(reason)
            .next("give --password-file a file that you can read, with the password as its first line")
    })?;
    Password::new(text.lines().next().unwrap_or_default()).map_err(|error| refused(&error).because(path.display()))
}

/// The token of a file, which is made with a new one where it is not there.
fn kept_token(path: &Path) -> Result<Token, Failure> {
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    match options.open(path) {
        Ok(mut file) => {
            let token = Token::random().map_err(|error| refused(&error))?;
            writeln!(file, "{}", token.text()).map_err(|error| Failure::of_writing("the token", path, &error))?;
            Ok(token)
        }
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            let text = read_text(path).map_err(|reason| {
                Failure::bad_file(format!("cannot read the token from {}", path.display()))
                    .because(reason)
                    .next("give --token-file a file that you can read, or a path where no file is: it is created")
            })?;
            Token::new(text.lines().next().unwrap_or_default()).map_err(|error| refused(&error).because(path.display()))
        }
        Err(error) => Err(Failure::of_writing("the token", path, &error)),
    }
}

fn refused(error: &AccessError) -> Failure {
    let of_file = Failure::bad_file(error.to_string());
    match error {
        AccessError::NoPassword(_) => Failure::usage(error.to_string())
            .because("anyone who reaches a studio from another machine can move the drives and see all traffic")
            .next("give --password-file FILE too, or --listen 127.0.0.1:8402 and reach it through `ssh -L 8402:127.0.0.1:8402`"),
        AccessError::ShortPassword(_) => of_file.next("choose a longer one, e.g. four words that do not belong together"),
        AccessError::BadToken => of_file.next("delete the file: it is created with a new token"),
        AccessError::NoRandom(_) => Failure::new(error.to_string())
            .next("start it again when the system has random numbers, which it may lack just after it was booted"),
    }
}

/// Opens the page as the desktop does; where that fails, the address has been printed.
async fn open(context: &Context, url: &str) {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let mut command = Command::new(program);
    command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // A browser that it starts may keep it until the last window is closed.
    let (ended, end) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || ended.send(command.status()));
    let why = match end.await {
        // The status of `explorer` says nothing.
        Ok(Ok(status)) if status.success() || cfg!(windows) => return,
        // `xdg-open` is there, and finds no browser: 3 or 4.
        Ok(Ok(status)) => status.to_string(),
        Ok(Err(error)) => error.to_string(),
        Err(_) => return,
    };
    context.note(&format!("cannot open a browser ({program}: {why}): open the address yourself"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use processes::scratch;

    #[test]
    fn a_token_file_is_made_once_for_its_owner_and_refused_if_it_holds_none() {
        let folder = scratch("token_file");
        let path = folder.join("token");
        let text = |token: Result<Token, Failure>| token.expect("a token").text().to_owned();
        let made = text(kept_token(&path));
        assert_eq!(text(kept_token(&path)), made);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&path).expect("it is there").permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
        for bad in ["", "short\n", "0123456789abcdef 0123456789abcdef\n"] {
            std::fs::write(&path, bad).expect("written");
            let failure = kept_token(&path).expect_err(bad);
            assert!(
                failure.what.contains("expected a token") && failure.next[0].contains("delete the file"),
                "{failure:?}"
            );
        }
        let nowhere = folder.join("no/such/token");
        assert_eq!(kept_token(&nowhere).expect_err("no such folder").kind, "file");
    }
}
