//! What Linux reports of its CAN interfaces (in `/sys/class/net`), and what stands in the way of opening one.

use std::fs;
use std::io;
use std::path::Path;

/// Where interfaces are listed.
pub(super) const SYSTEM: &str = "/sys/class/net";

/// Kind of hardware of a CAN interface (`ARPHRD_CAN`, `linux/if_arp.h`).
const HARDWARE_CAN: u32 = 280;

/// Flag of an interface that is up (`IFF_UP`, `linux/if.h`).
const FLAG_UP: u32 = 1;

/// Why a CAN interface cannot be used. Prints with what to do.
#[derive(Debug, thiserror::Error)]
pub enum InterfaceProblem {
    /// No such interface, or it was removed.
    #[error("there is no interface {name}{}", others(.existing))]
    Missing {
        /// Its name.
        name: String,
        /// The CAN interfaces that are there.
        existing: Vec<String>,
    },
    /// It is not up.
    #[error("{name} is down: ip link set {name} up{}", if *.is_virtual { "" } else { " type can bitrate 500000" })]
    Down {
        /// Its name.
        name: String,
        /// Whether it is a virtual one, without a bit rate.
        is_virtual: bool,
    },
    /// An interface of another kind.
    #[error("{name} is not a CAN interface{}", others(.existing))]
    NotCan {
        /// Its name.
        name: String,
        /// The CAN interfaces that are there.
        existing: Vec<String>,
    },
    /// The kernel has no CAN.
    #[error(
        "the kernel of this machine has no CAN, so '{name}' cannot be opened: load it (modprobe can_raw), or run \
         `socketcand -i {name}` where it has and use socketcand://HOST:29536/{name}, or use slcan:///dev/ttyACM0"
    )]
    NoKernelCan {
        /// The interface asked for.
        name: String,
    },
    /// The user may not.
    #[error("this user may not open {name}: run as one who may, and give a container the network of its host")]
    NotPermitted {
        /// Its name.
        name: String,
    },
    /// The system is not Linux.
    #[error("{name} is an interface of Linux, and this system is another: use socketcand://HOST:29536/{name} or slcan")]
    NotLinux {
        /// The interface asked for.
        name: String,
    },
    /// Something else.
    #[error("{name} cannot be opened")]
    System {
        /// Its name.
        name: String,
        /// What the system said.
        source: io::Error,
    },
}

fn others(existing: &[String]) -> String {
    if existing.is_empty() {
        ", and no other of CAN; a virtual one: ip link add dev vcan0 type vcan && ip link set vcan0 up".to_owned()
    } else {
        format!("; there is {}", existing.join(", "))
    }
}

impl InterfaceProblem {
    /// What the system's answer `error` means for the interface `name`; numbers of errors are those of Linux.
    #[cfg(target_os = "linux")]
    pub(super) fn of(name: &str, error: io::Error) -> Self {
        use nix::errno::Errno;
        let name = name.to_owned();
        match error.raw_os_error().map(Errno::from_raw) {
            Some(Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT | Errno::ESOCKTNOSUPPORT) => Self::NoKernelCan { name },
            Some(Errno::EPERM | Errno::EACCES) => Self::NotPermitted { name },
            Some(Errno::ENODEV | Errno::ENXIO | Errno::EADDRNOTAVAIL) => {
                Self::Missing { name, existing: existing(Path::new(SYSTEM)) }
            }
            Some(Errno::ENETDOWN) => Self::down(Path::new(SYSTEM), name),
            _ => Self::System { name, source: error },
        }
    }

    fn down(system: &Path, name: String) -> Self {
        // A virtual interface is a link into the folder of virtual devices.
        let device = fs::read_link(system.join(&name)).unwrap_or_default();
        let is_virtual = device.components().any(|part| part.as_os_str() == "virtual");
        Self::Down { is_virtual, name }
    }

    /// Whether it may pass by itself: the interface is set up, or its adapter plugged in.
    pub(super) fn may_pass(&self) -> bool {
        matches!(self, Self::Missing { .. } | Self::Down { .. })
    }
}

/// Looks at the interface `name` in `system`; whether it has a carrier, which a controller that is bus-off has not.
pub(super) fn look(system: &Path, name: &str) -> Result<bool, InterfaceProblem> {
    let folder = system.join(name);
    let number = |file: &str| {
        let text = fs::read_to_string(folder.join(file)).ok()?;
        let text = text.trim();
        text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |digits| u32::from_str_radix(digits, 16).ok())
    };
    match number("type") {
        // A system that reports nothing of interfaces may have it all the same: opening it shows that.
        None if !system.is_dir() => return Ok(true),
        None => return Err(InterfaceProblem::Missing { name: name.to_owned(), existing: existing(system) }),
        Some(HARDWARE_CAN) => {}
        Some(_) => return Err(InterfaceProblem::NotCan { name: name.to_owned(), existing: existing(system) }),
    }
    if number("flags").is_some_and(|flags| flags & FLAG_UP == 0) {
        return Err(InterfaceProblem::down(system, name.to_owned()));
    }
    Ok(number("carrier") != Some(0))
}

/// The CAN interfaces of this machine, by name; none where the system is not Linux.
pub fn can_interfaces() -> Vec<String> {
    existing(Path::new(SYSTEM))
}

/// The CAN interfaces of a system, by name.
pub(super) fn existing(system: &Path) -> Vec<String> {
    let entries = fs::read_dir(system).into_iter().flatten().flatten();
    let of_can = entries.filter(|entry| {
        fs::read_to_string(entry.path().join("type")).is_ok_and(|text| text.trim() == HARDWARE_CAN.to_string())
    });
    let mut names: Vec<String> = of_can.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::os::unix::fs::symlink;

    use tempfile::TempDir;

    use super::*;

    /// A folder as `/sys/class/net` is: name, type, flags, carrier.
    fn system(interfaces: &[(&str, &str, &str, &str)]) -> TempDir {
        let system = tempfile::tempdir().unwrap();
        for (name, kind, flags, carrier) in interfaces {
            let folder = system.path().join(if name.starts_with('v') { "virtual" } else { "pci" }).join(name);
            fs::create_dir_all(&folder).unwrap();
            for (file, text) in [("type", kind), ("flags", flags), ("carrier", carrier)] {
                fs::write(folder.join(file), format!("{text}\n")).unwrap();
            }
            symlink(&folder, system.path().join(name)).unwrap();
        }
        system
    }

    #[test]
    fn what_stands_in_the_way_is_said_with_what_to_do() {
        let folder = system(&[
            ("can0", "280", "0x40081", "1"),
            ("can1", "280", "0x40080", "0"),
            ("can2", "280", "0x40081", "0"),
            ("vcan0", "280", "0x80", ""),
            ("eth0", "1", "0x1003", "1"),
        ]);
        let system = folder.path();
        let said = |name: &str| look(system, name).unwrap_err().to_string();
        assert!(look(system, "can0").unwrap());
        // Up and without a carrier: bus-off.
        assert!(!look(system, "can2").unwrap());
        assert_eq!(said("can1"), "can1 is down: ip link set can1 up type can bitrate 500000");
        assert_eq!(said("vcan0"), "vcan0 is down: ip link set vcan0 up");
        assert_eq!(said("can7"), "there is no interface can7; there is can0, can1, can2, vcan0");
        assert_eq!(said("eth0"), "eth0 is not a CAN interface; there is can0, can1, can2, vcan0");
        fs::remove_dir_all(system).unwrap();
        assert!(look(system, "can0").unwrap(), "a system that reports nothing may have it");
    }

    #[test]
    fn a_machine_without_an_interface_is_shown_how_to_make_one() {
        let said = look(system(&[]).path(), "can0").unwrap_err().to_string();
        assert!(said.contains("ip link add dev vcan0 type vcan"), "{said}");
    }

    /// Numbers: `asm-generic/errno.h`.
    #[test]
    fn answers_of_the_kernel_have_a_meaning() {
        for (number, part, may_pass) in [
            (97, "the kernel of this machine has no CAN", false),
            (93, "the kernel of this machine has no CAN", false),
            (1, "this user may not open can0", false),
            (13, "this user may not open can0", false),
            (19, "there is no interface can0", true),
            (6, "there is no interface can0", true),
            (100, "can0 is down", true),
            (12, "can0 cannot be opened", false),
        ] {
            let problem = InterfaceProblem::of("can0", io::Error::from_raw_os_error(number));
            assert!(problem.to_string().contains(part), "{number}: {problem}");
            assert_eq!(problem.may_pass(), may_pass, "{number}");
        }
    }
}
