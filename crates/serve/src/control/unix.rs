//! A Unix socket that only this user can ever reach, and that removes no path but its own.

use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use socket2::{Domain, SockAddr, Socket, Type};
use tokio::net::UnixListener;

/// Connections that may wait to be accepted.
const BACKLOG: i32 = 128;

/// The path of a socket, removed when this is dropped, if it is still that socket.
pub(super) struct OwnPath {
    path: PathBuf,
    /// Device and inode.
    identity: (u64, u64),
}

/// A socket in place of one without a listener.
///
/// Between its binding and its listening no client can connect to it; in that time it is made this user's alone.
pub(super) fn bind(path: &Path) -> io::Result<(UnixListener, OwnPath)> {
    if let Ok(metadata) = std::fs::symlink_metadata(path) {
        if !metadata.file_type().is_socket() {
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, "the path exists and is not a socket"));
        }
        if std::os::unix::net::UnixStream::connect(path).is_ok() {
            return Err(io::Error::new(io::ErrorKind::AddrInUse, "another program listens there"));
        }
        std::fs::remove_file(path)?;
    }
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    socket.bind(&SockAddr::unix(path)?)?;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600))?;
    let own = OwnPath { path: path.to_owned(), identity: identity(path)? };
    socket.listen(BACKLOG)?;
    socket.set_nonblocking(true)?;
    Ok((UnixListener::from_std(socket.into())?, own))
}

fn identity(path: &Path) -> io::Result<(u64, u64)> {
    let metadata = std::fs::symlink_metadata(path)?;
    Ok((metadata.dev(), metadata.ino()))
}

impl Drop for OwnPath {
    fn drop(&mut self) {
        if identity(&self.path).is_ok_and(|identity| identity == self.identity) {
            // What is gone in the meantime need not be removed.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_path_is_removed_at_the_end_unless_it_is_somebody_elses_by_then() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("bench.sock");
        drop(bind(&path).expect("it listens"));
        assert!(!path.exists(), "it is ours");
        let ours = bind(&path).expect("it listens");
        std::fs::remove_file(&path).expect("it is there");
        let other = std::os::unix::net::UnixListener::bind(&path).expect("the path is free");
        drop(ours);
        assert!(path.exists(), "the socket of another program");
        drop(other);
    }
}
