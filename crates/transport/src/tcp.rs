//! How TCP is made to carry a conversation of small messages.
//!
//! Two of its economies cost a CAN frame 40 ms. Nagle's algorithm holds a small segment back while an earlier one is not
//! acknowledged; a receiver delays its acknowledgement, hoping to send it along with an answer. Each end can end one of them:
//! the sender by TCP_NODELAY, the receiver by acknowledging at once. We do both, so that a peer which does neither gets its
//! frames through in time.
//!
//! A peer that vanishes without a word (a cable, a power failure) would be noticed after a quarter of an hour; [`notice_loss`]
//! makes that a few seconds.

#[cfg(target_os = "linux")]
use std::time::Duration;

use tokio::net::TcpStream;

/// How long a peer may leave what we sent, or a question whether it is there, unanswered.
#[cfg(target_os = "linux")]
const LOSS_AFTER: Duration = Duration::from_secs(5);

/// Our segments are sent at once.
pub(crate) fn send_at_once(stream: &TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)
}

/// Acknowledges what has been received, now. To be called after each read, because the kernel goes back to delaying by itself
/// (tcp(7), TCP_QUICKACK). Where the system has no such option, the peer's own TCP_NODELAY has to do.
pub(crate) fn acknowledge_at_once(stream: &TcpStream) {
    // Refused only for a connection that is gone, which the next read shows.
    #[cfg(target_os = "linux")]
    let _ = rustix::net::sockopt::set_tcp_quickack(stream, true);
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
}

/// Has the connection break when the peer has answered nothing for some seconds, instead of minutes (tcp(7), TCP_USER_TIMEOUT and
/// TCP_KEEPIDLE). Where the system has no such options, its own patience counts.
pub(crate) fn notice_loss(stream: &TcpStream) -> std::io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::net::sockopt;
        sockopt::set_socket_keepalive(stream, true)?;
        sockopt::set_tcp_keepidle(stream, Duration::from_secs(2))?;
        sockopt::set_tcp_keepintvl(stream, Duration::from_secs(1))?;
        sockopt::set_tcp_user_timeout(stream, LOSS_AFTER.as_millis() as u32)?;
    }
    #[cfg(not(target_os = "linux"))]
    let _ = stream;
    Ok(())
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use rustix::net::sockopt::tcp_quickack;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpListener;

    use super::*;

    /// A server that answers each message soon has the kernel delay its acknowledgements ("ping-pong"): that is what ends.
    #[tokio::test]
    async fn a_connection_that_has_begun_to_delay_its_acknowledgements_is_brought_back() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (mut server, _) = listener.accept().await.unwrap();
        send_at_once(&client).unwrap();
        send_at_once(&server).unwrap();
        let mut byte = [0];
        for _ in 0..50 {
            client.write_all(b"?").await.unwrap();
            server.read_exact(&mut byte).await.unwrap();
            server.write_all(b"!").await.unwrap();
            client.read_exact(&mut byte).await.unwrap();
        }
        assert!(!tcp_quickack(&server).unwrap(), "the kernel delays: else this test shows nothing");
        acknowledge_at_once(&server);
        assert!(tcp_quickack(&server).unwrap());
    }
}
