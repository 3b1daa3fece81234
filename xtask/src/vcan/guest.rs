//! One run of the guest: QEMU with the host's files, two emulated CAN cards on one bus, and the checks.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::say::say;

use super::image::Image;

/// Longest time until the checks begin. An emulated processor on a busy machine boots in one to two minutes.
const BOOT_LIMIT: Duration = Duration::from_secs(300);

/// Longest time that the checks may take.
const CHECKS_LIMIT: Duration = Duration::from_secs(600);

const POLL: Duration = Duration::from_millis(200);

/// What the checks printed, and whether they ended with status 0.
pub(super) struct Output {
    pub(super) text: String,
    pub(super) ended_well: bool,
}

/// How often a guest is booted until its clock is right.
const BOOTS: usize = 4;

/// Boots the guest, lets it run the shell script `checks` and waits for its end.
///
/// Its kernel times the counter of an emulated processor as it boots. On a busy machine it may find a rate that is too low, once a third,
/// and the time-outs of the checks are as much shorter than they should be: such a guest is booted again.
pub(super) fn run(image: &Image, checks: &str) -> Result<Output, String> {
    for _ in 0..BOOTS {
        if let Some(output) = run_once(image, checks)? {
            return Ok(output);
        }
    }
    Err(format!("the clock of the guest ran ahead of ours {BOOTS} times"))
}

/// `None` if its clock runs ahead.
fn run_once(image: &Image, checks: &str) -> Result<Option<Output>, String> {
    let folder = Folder::make()?;
    let control = folder.0.join("control");
    let write = |name: &str, text: &str| {
        fs::create_dir_all(&control)
            .and_then(|()| fs::write(control.join(name), text))
            .map_err(|error| error.to_string())
    };
    write("main.sh", include_str!("main.sh"))?;
    write("checks.sh", checks)?;
    let console = folder.0.join("console");
    let mut guest = Guest(start(image, &control, &console)?);
    let reported = |name: &str| fs::read_to_string(control.join(name)).ok().filter(|text| !text.trim().is_empty());
    let began = Instant::now();
    let mut limit = began + BOOT_LIMIT;
    let mut started = false;
    while guest.0.try_wait().map_err(|error| error.to_string())?.is_none() {
        if !started && let Some(uptime) = reported("started") {
            let (its, ours) = (uptime.trim(), began.elapsed().as_secs_f64());
            say(format_args!("the guest has started ({its} s by its clock, {ours:.0} s by ours)"));
            // It has begun later than we have, so that its uptime is the shorter one.
            if its.parse().is_ok_and(|its: f64| its > ours + 1.0) {
                say("its clock is too fast: booting it again");
                return Ok(None);
            }
            (started, limit) = (true, Instant::now() + CHECKS_LIMIT);
        }
        if Instant::now() > limit {
            let text = reported("output").unwrap_or_default();
            return Err(format!(
                "the guest took too long; it said last: {}{}",
                last_words(&text),
                last_words(&read(&console))
            ));
        }
        sleep(POLL);
    }
    match reported("status") {
        Some(status) => {
            let ended_well = status.trim() == "0";
            // What programs said beside their results is of interest when something failed.
            let said = if ended_well { String::new() } else { reported("errors").unwrap_or_default() };
            Ok(Some(Output { text: reported("output").unwrap_or_default() + &said, ended_well }))
        }
        None => Err(format!("the guest ended without a result; it said last: {}", last_words(&read(&console)))),
    }
}

/// A running QEMU, which ends with this.
struct Guest(Child);

impl Drop for Guest {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder of this run alone, which is removed with this.
struct Folder(PathBuf);

impl Folder {
    fn make() -> Result<Self, String> {
        let path = std::env::temp_dir().join(format!("ferrodrive-vcan-{}", std::process::id()));
        fs::create_dir_all(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn start(image: &Image, control: &Path, console: &Path) -> Result<Child, String> {
    let share = |id: &str, path: &Path, more: &str| {
        // A comma separates options, and two of them are one.
        let path = path.display().to_string().replace(',', ",,");
        format!("local,id={id},path={path},security_model=none,multidevs=remap{more}")
    };
    let mut qemu = Command::new("qemu-system-x86_64");
    qemu.args([
        "-nodefaults",
        "-no-user-config",
        "-display",
        "none",
        "-no-reboot",
        "-monitor",
        "none",
        "-M",
        "q35",
        "-m",
        "2048",
    ]);
    if has_kvm() {
        qemu.args(["-accel", "kvm", "-cpu", "host"]);
    } else {
        // Protections that an emulated processor pays for, and that nothing here needs.
        qemu.args([
            "-accel",
            "tcg,thread=multi,tb-size=512",
            "-cpu",
            "max,la57=off,smap=off,smep=off,umip=off,pku=off",
        ]);
    }
    qemu.arg("-kernel").arg(&image.kernel).arg("-initrd").arg(&image.initrd);
    qemu.arg("-append").arg(
        "console=ttyS0 quiet panic=-1 oops=panic mitigations=off apparmor=0 audit=0 random.trust_cpu=on tsc=reliable \
         no_timer_check cryptomgr.notests 8250.nr_uarts=1 net.ifnames=0",
    );
    qemu.arg("-serial").arg(format!("file:{}", console.display()));
    for (tag, path, more) in [("root", Path::new("/"), ",readonly=on"), ("control", control, "")] {
        qemu.arg("-fsdev").arg(share(tag, path, more));
        qemu.arg("-device").arg(format!("virtio-9p-pci,fsdev={tag},mount_tag={tag}"));
    }
    qemu.args(["-object", "can-bus,id=bus", "-device", "kvaser_pci,canbus=bus", "-device", "kvaser_pci,canbus=bus"]);
    qemu.stdin(Stdio::null()).stdout(Stdio::null()).spawn().map_err(|error| format!("cannot run QEMU: {error}"))
}

/// Whether this machine lets its processor run a guest. A device file alone is not enough: some clouds have one that cannot.
fn has_kvm() -> bool {
    let may = fs::OpenOptions::new().read(true).write(true).open("/dev/kvm").is_ok();
    let flags = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    may && flags.split_whitespace().any(|flag| matches!(flag, "vmx" | "svm"))
}

fn read(path: &Path) -> String {
    fs::read(path).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default()
}

fn last_words(text: &str) -> String {
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines[lines.len().saturating_sub(15)..].iter().map(|line| format!("\n     {}", line.trim())).collect()
}
