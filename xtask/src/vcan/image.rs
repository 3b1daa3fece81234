//! The guest's kernel and its first file system, made out of two Debian packages and kept under `target/`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use crate::debian;
use crate::process::{self, quietly};
use crate::say::say;
use crate::workspace;

/// Raised when what is kept has to be made anew.
const FORMAT: u32 = 3;

/// Kernel modules of the guest: shared files, an overlay in memory, CAN, a queue that can be stuck.
const MODULES: &[&str] =
    &["virtio_pci", "9pnet_virtio", "9p", "overlay", "can", "can_raw", "can_bcm", "vcan", "kvaser_pci", "sch_netem"];

/// Folders of the kernel's package in which these modules and what they need stand.
const FOLDERS: &[&str] = &[
    "kernel/net/*",
    "kernel/fs/9p/*",
    "kernel/fs/netfs/*",
    "kernel/fs/fscache/*",
    "kernel/fs/overlayfs/*",
    "kernel/drivers/virtio/*",
    "kernel/drivers/net/can/*",
    "kernel/lib/*",
    "kernel/crypto/*",
    "modules.builtin",
    "modules.order",
];

/// What a guest is booted from.
pub(super) struct Image {
    pub(super) kernel: PathBuf,
    pub(super) initrd: PathBuf,
}

/// The image, made now if need be; or why there is none.
pub(super) fn prepare() -> Result<Image, String> {
    // A second step finds what the first has made.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    if std::env::consts::OS != "linux" || std::env::consts::ARCH != "x86_64" {
        return Err("the guest is for an x86-64 machine with Linux".to_owned());
    }
    debian::install(PROGRAMS)?;
    let folder = workspace::target().join("vcan-vm").join(format!("v{FORMAT}"));
    let image = Image { kernel: folder.join("kernel"), initrd: folder.join("initrd") };
    if image.initrd.exists() {
        return Ok(image);
    }
    say("fetching the guest's kernel (once, some 70 MB)");
    let work = folder.with_extension("making");
    let _ = fs::remove_dir_all(&work);
    let made = fs::create_dir_all(work.join("packages")).map_err(|error| format!("{}: {error}", work.display()));
    made.and_then(|()| make(&work))?;
    let _ = fs::remove_dir_all(&folder);
    fs::rename(&work, &folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(image)
}

/// Programs of Debian packages that the guest is made and run with.
const PROGRAMS: &[(&str, &str)] =
    &[("qemu-system-x86_64", "qemu-system-x86"), ("xz", "xz-utils"), ("cansend", "can-utils"), ("ip", "iproute2")];

fn make(work: &Path) -> Result<(), String> {
    let packages = work.join("packages");
    download(&packages)?;
    let files = work.join("files");
    let mut release = None;
    for package in list(&packages)? {
        if package.to_string_lossy().contains("busybox") {
            quietly(Command::new("dpkg-deb").arg("-x").arg(&package).arg(work.join("busybox-package")))?;
        } else {
            unpack_kernel_package(&package, &files)?;
            release = Some(());
        }
    }
    release.ok_or("no package of a kernel was downloaded")?;
    if !files.join("lib").exists() {
        fs::rename(files.join("usr/lib"), files.join("lib"))
            .map_err(|error| format!("the kernel's package: {error}"))?;
    }
    let modules = list(&files.join("lib/modules"))?.pop().ok_or("the kernel's package has no modules")?;
    let boot = list(&files.join("boot"))?.pop().ok_or("the kernel's package has no kernel")?;
    unpack_kernel(&boot, &work.join("kernel"))?;
    let busybox = ["bin/busybox", "usr/bin/busybox"].map(|place| work.join("busybox-package").join(place));
    let busybox = busybox.into_iter().find(|place| place.exists()).ok_or("the package of busybox has no busybox")?;
    make_initrd(work, &files, &modules, &busybox)?;
    for done in ["packages", "files", "busybox-package", "root"] {
        let _ = fs::remove_dir_all(work.join(done));
    }
    Ok(())
}

/// Downloads the kernel that Debian's `linux-image-amd64` stands for, and busybox.
fn download(folder: &Path) -> Result<(), String> {
    let fetch = || -> Result<(), String> {
        let depends = process::output(Command::new("apt-cache").args(["depends", "linux-image-amd64"]))?;
        let kernel = depends.lines().find_map(|line| {
            line.trim().strip_prefix("Depends: ").filter(|name| name.starts_with("linux-image-")).map(str::to_owned)
        });
        let kernel = kernel.ok_or("apt knows no linux-image-amd64")?;
        quietly(debian::apt().args(["download", &kernel, "busybox-static"]).current_dir(folder))
    };
    let fetched = fetch().or_else(|_| quietly(debian::apt().arg("update")).and_then(|()| fetch()));
    fetched.map_err(|error| format!("the guest's kernel cannot be downloaded: {}", debian::last_line(&error)))
}

fn list(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    Ok(paths)
}

fn unpack_kernel_package(package: &Path, files: &Path) -> Result<(), String> {
    fs::create_dir_all(files).map_err(|error| format!("{}: {error}", files.display()))?;
    let archive = files.with_extension("tar");
    let out = fs::File::create(&archive).map_err(|error| format!("{}: {error}", archive.display()))?;
    let unpacked = Command::new("dpkg-deb").arg("--fsys-tarfile").arg(package).stdout(out).status();
    if !unpacked.is_ok_and(|status| status.success()) {
        return Err(format!("{} cannot be unpacked", package.display()));
    }
    // tar minds a pattern that matches nothing, and kernels differ in what they have built in; what is missing shows below.
    let mut tar = Command::new("tar");
    tar.arg("-xf")
        .arg(&archive)
        .arg("-C")
        .arg(files)
        .args(["--wildcards", "--no-anchored", "boot/vmlinuz-*"])
        .args(FOLDERS);
    let _ = process::output(&mut tar);
    fs::remove_file(&archive).map_err(|error| error.to_string())?;
    for (suffix, program) in [("xz", "xz"), ("zst", "zstd")] {
        let found = process::output(Command::new("find").arg(files).args(["-name", &format!("*.ko.{suffix}")]))?;
        let found: Vec<&str> = found.lines().collect();
        for some in found.chunks(500) {
            quietly(Command::new(program).args(["-d", "-q"]).args(some))?;
        }
    }
    Ok(())
}

/// The kernel inside a compressed one (`bzImage`), so that the guest need not unpack it: that takes an emulated processor half a
/// minute. Where it is: `Documentation/x86/boot.rst` (setup_sects, payload_offset, payload_length).
fn unpack_kernel(packed: &Path, kernel: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", packed.display());
    let bytes = fs::read(packed).map_err(failed)?;
    let payload = payload(&bytes).ok_or_else(|| format!("{} is not a kernel", packed.display()))?;
    let program = match payload {
        [0xFD, b'7', b'z', ..] => Some("xz"),
        [0x1F, 0x8B, ..] => Some("gzip"),
        [0x28, 0xB5, 0x2F, 0xFD, ..] => Some("zstd"),
        _ => None,
    };
    let inner = kernel.with_extension("packed");
    fs::write(&inner, payload).map_err(failed)?;
    let out = fs::File::create(kernel).map_err(failed)?;
    let input = fs::File::open(&inner).map_err(failed)?;
    // What follows the packed kernel is its length, which the programs take for rubbish; what they unpacked is whole.
    let mut unpack = Command::new(program.unwrap_or("false"));
    let _ = unpack.args(["-d", "-c", "-q"]).stdin(input).stdout(out).stderr(std::process::Stdio::null()).status();
    fs::remove_file(&inner).map_err(failed)?;
    let unpacked = fs::read(kernel).map_err(failed)?;
    if !unpacked.starts_with(b"\x7FELF") {
        fs::copy(packed, kernel).map_err(failed)?;
    }
    Ok(())
}

fn payload(bytes: &[u8]) -> Option<&[u8]> {
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let start = (usize::from(*bytes.get(0x1F1)?) + 1) * 512 + word(0x248)?;
    bytes.get(start..start.checked_add(word(0x24C)?)?)
}

/// The first file system: busybox, the modules in the order in which they are loaded, and the first program.
fn make_initrd(work: &Path, files: &Path, modules: &Path, busybox: &Path) -> Result<(), String> {
    let root = work.join("root");
    let failed = |error: std::io::Error| format!("the guest's first files: {error}");
    for folder in ["bin", "modules", "lower", "upper", "new", "proc", "dev"] {
        fs::create_dir_all(root.join(folder)).map_err(failed)?;
    }
    let release = modules.file_name().unwrap_or_default();
    quietly(Command::new(busybox).arg("depmod").arg("-b").arg(files).arg(release))?;
    let table = fs::read_to_string(modules.join("modules.dep")).map_err(failed)?;
    let builtin = fs::read_to_string(modules.join("modules.builtin")).unwrap_or_default();
    let order = load_order(&table, &builtin)?;
    let mut names = Vec::new();
    for (place, module) in order.iter().enumerate() {
        let file = Path::new(module).file_name().unwrap_or_default().to_string_lossy().into_owned();
        names.push(format!("{place:03}-{file}"));
        fs::copy(modules.join(module), root.join("modules").join(&names[place])).map_err(failed)?;
    }
    fs::write(root.join("modules/order"), names.join("\n")).map_err(failed)?;
    fs::copy(busybox, root.join("bin/busybox")).map_err(failed)?;
    fs::write(root.join("init"), include_str!("init.sh")).map_err(failed)?;
    quietly(Command::new("chmod").arg("755").arg(root.join("init")).arg(root.join("bin/busybox")))?;
    let mut pack = Command::new("sh");
    pack.arg("-c").arg("cd \"$1\" && find . | \"$2\" cpio -o -H newc >\"$3\" 2>/dev/null").arg("sh");
    quietly(pack.arg(&root).arg(busybox).arg(work.join("initrd")))
}

/// The files of [`MODULES`] and what they need, each behind what it needs. `table` is `modules.dep`: a file, a colon, and all that it
/// needs, the last one to be loaded first.
fn load_order(table: &str, builtin: &str) -> Result<Vec<String>, String> {
    let name = |path: &str| {
        let file = path.rsplit('/').next().unwrap_or(path);
        file.split('.').next().unwrap_or(file).replace('-', "_")
    };
    let mut order: Vec<String> = Vec::new();
    for wanted in MODULES {
        let line = table.lines().filter_map(|line| line.split_once(':')).find(|(path, _)| name(path) == *wanted);
        let Some((path, needs)) = line else {
            if builtin.lines().any(|path| name(path) == *wanted) {
                continue;
            }
            return Err(format!("the guest's kernel has no module {wanted}"));
        };
        for path in needs.split_whitespace().rev().chain([path]) {
            if !order.iter().any(|known| known == path) {
                order.push(path.to_owned());
            }
        }
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_are_loaded_behind_what_they_need() {
        let table = "k/virtio_pci.ko: k/virtio_ring.ko k/virtio.ko\nk/9pnet_virtio.ko: k/9pnet.ko k/virtio_ring.ko k/virtio.ko\n\
                     k/9p.ko: k/9pnet.ko\nk/overlay.ko:\nk/can.ko:\nk/can-raw.ko: k/can.ko\nk/can-bcm.ko: k/can.ko\nk/vcan.ko: k/can-dev.ko\n\
                     k/kvaser_pci.ko: k/sja1000.ko k/can-dev.ko\nk/sch_netem.ko:\n";
        let order = load_order(table, "").unwrap();
        let at = |name: &str| order.iter().position(|path| path == name).unwrap();
        assert!(at("k/virtio.ko") < at("k/virtio_ring.ko") && at("k/virtio_ring.ko") < at("k/virtio_pci.ko"));
        assert!(at("k/can.ko") < at("k/can-raw.ko") && at("k/can-dev.ko") < at("k/sja1000.ko"));
        assert_eq!(order.len(), 15, "{order:?}");
        let built_in = load_order(&table.replace("k/overlay.ko:\n", ""), "k/overlay.ko\n").unwrap();
        assert_eq!(built_in.len(), 14);
        assert!(load_order("", "").unwrap_err().contains("virtio_pci"));
    }

    #[test]
    fn the_payload_of_a_kernel_is_where_its_header_says() {
        let mut bytes = vec![0; 4096];
        bytes[0x1F1] = 2;
        bytes[0x248..0x24C].copy_from_slice(&100_u32.to_le_bytes());
        bytes[0x24C..0x250].copy_from_slice(&3_u32.to_le_bytes());
        bytes[3 * 512 + 100..][..3].copy_from_slice(b"abc");
        assert_eq!(payload(&bytes), Some(&b"abc"[..]));
        bytes[0x24C..0x250].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(payload(&bytes), None);
        assert_eq!(payload(b"short"), None);
    }
}
