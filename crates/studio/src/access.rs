//! Access control: a token for each launch, a cookie in its place, the page's own origin, and a password for other machines.
//!
//! A page of another site can make a browser send requests to this server, including the cookie. It cannot forge its
//! origin: every request that changes something has to come from a page of this server. A name of another site
//! that resolves to this server (DNS rebinding) is refused by its Host.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, COOKIE, HOST, HeaderName, ORIGIN};
use subtle::ConstantTimeEq;

/// Bytes of a secret: too many to guess.
const SECRET_BYTES: usize = 16;

/// The shortest accepted token, in characters.
const SHORTEST_TOKEN: usize = 2 * SECRET_BYTES;

/// The shortest accepted password, in characters.
const SHORTEST_PASSWORD: usize = 12;

/// Why a studio cannot be opened to other machines.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// Others could move the drives.
    #[error("{0} can be reached from other machines: a password is required")]
    NoPassword(SocketAddr),
    /// The password is too easy to guess.
    #[error("the password has {0} characters, expected at least {SHORTEST_PASSWORD}")]
    ShortPassword(usize),
    /// The token is too easy to guess, or cannot be part of an address.
    #[error("expected a token of {SHORTEST_TOKEN} or more letters, digits, - and _")]
    BadToken,
    /// The system has no random numbers.
    #[error("cannot get random numbers for a token from the system: {0}")]
    NoRandom(getrandom::Error),
}

/// The password for clients on other machines.
#[derive(Clone)]
pub struct Password(String);

impl core::fmt::Debug for Password {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Password(..)")
    }
}

impl Password {
    /// Takes a password.
    ///
    /// # Errors
    /// [`AccessError::ShortPassword`].
    pub fn new(text: impl Into<String>) -> Result<Self, AccessError> {
        let text = text.into();
        match text.chars().count() {
            short if short < SHORTEST_PASSWORD => Err(AccessError::ShortPassword(short)),
            _ => Ok(Self(text)),
        }
    }
}

/// A secret that admits its bearer, where it is kept over launches.
#[derive(Clone)]
pub struct Token(String);

impl core::fmt::Debug for Token {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Token(..)")
    }
}

impl Token {
    /// Takes a token.
    ///
    /// # Errors
    /// [`AccessError::BadToken`].
    pub fn new(text: impl Into<String>) -> Result<Self, AccessError> {
        let text = text.into();
        let is_plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'));
        if is_plain && text.len() >= SHORTEST_TOKEN { Ok(Self(text)) } else { Err(AccessError::BadToken) }
    }

    /// A new one.
    ///
    /// # Errors
    /// [`AccessError::NoRandom`].
    pub fn random() -> Result<Self, AccessError> {
        secret().map(Self)
    }

    /// Its text, to be kept where only its owner can read it.
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// Access control: a token for each launch or a kept one, a cookie in its place, the page's own origin, and a password for other machines.
pub struct Access {
    address: SocketAddr,
    /// Part of the printed address.
    token: String,
    /// The value of the cookie that replaces the token.
    pass: String,
    password: Option<Password>,
    /// Further names of this server.
    hosts: Vec<String>,
}

impl core::fmt::Debug for Access {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Access").field("address", &self.address).finish_non_exhaustive()
    }
}

impl Access {
    /// New secrets for a server that listens at `address`.
    ///
    /// # Errors
    /// [`AccessError::NoPassword`] if other machines can reach it; [`AccessError::NoRandom`].
    pub fn new(address: SocketAddr, password: Option<Password>) -> Result<Self, AccessError> {
        if !address.ip().is_loopback() && password.is_none() {
            return Err(AccessError::NoPassword(address));
        }
        Ok(Self { address, token: secret()?, pass: secret()?, password, hosts: Vec::new() })
    }

    /// Takes this token in place of one of this launch. The cookie is the same too: a page that is open goes on after a restart.
    #[must_use]
    pub fn with_token(self, Token(token): Token) -> Self {
        Self { pass: token.clone(), token, ..self }
    }

    /// Accepts these host names, too: `drives.local`, with any port.
    #[must_use]
    pub fn with_hosts(self, hosts: Vec<String>) -> Self {
        Self { hosts, ..self }
    }

    /// The address to open on this machine, with the token of this launch: it gives access without a password, from anywhere.
    pub fn url(&self) -> String {
        let mut address = self.address;
        if address.ip().is_unspecified() {
            // The unspecified address cannot be opened.
            address.set_ip(if address.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
        }
        format!("http://{address}/?token={}", self.token)
    }

    /// True if a password gives access.
    pub(crate) const fn has_password(&self) -> bool {
        self.password.is_some()
    }

    pub(crate) fn is_token(&self, text: &str) -> bool {
        is_same(text, &self.token)
    }

    pub(crate) fn is_password(&self, text: &str) -> bool {
        self.password.as_ref().is_some_and(|password| is_same(text, &password.0))
    }

    /// The cookie that gives access. The browser keeps it until it is closed, sends it only with requests of this site, and hides
    /// it from scripts. Cookies ignore ports: its name has the port.
    pub(crate) fn cookie(&self) -> String {
        format!("{}={}; Path=/; HttpOnly; SameSite=Strict", self.cookie_name(), self.pass)
    }

    /// True if a request has the cookie, or the token as programs send it.
    pub(crate) fn lets_in(&self, headers: &HeaderMap) -> bool {
        let name = self.cookie_name();
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut cookies = cookies.flat_map(|value| value.split(';')).filter_map(|cookie| cookie.trim().split_once('='));
        let by_cookie = cookies.any(|(of, value)| of == name && is_same(value, &self.pass));
        let bearer = text(headers, AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        by_cookie || bearer.is_some_and(|token| self.is_token(token))
    }

    /// True if the Host of a request is a name of this server.
    pub(crate) fn is_for_us(&self, headers: &HeaderMap) -> bool {
        let Some(host) = text(headers, HOST) else { return false };
        let name = host.rsplit_once(':').map_or(host, |(name, port)| if port.ends_with(']') { host } else { name });
        let is_named = self.hosts.iter().any(|own| own.eq_ignore_ascii_case(name));
        // After DNS rebinding a browser sends the foreign name as Host; an address cannot be foreign.
        let is_address = host.parse::<SocketAddr>().is_ok() || name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok();
        let elsewhere = !self.address.ip().is_loopback() && is_address;
        is_named || elsewhere || self.own_hosts().iter().any(|own| own == host)
    }

    /// True if a request comes from a page of this server.
    pub(crate) fn is_from_us(&self, headers: &HeaderMap) -> bool {
        match (text(headers, ORIGIN), text(headers, HOST)) {
            (Some(origin), Some(host)) => origin.strip_prefix("http://") == Some(host) && self.is_for_us(headers),
            _ => false,
        }
    }

    fn own_hosts(&self) -> [String; 4] {
        let port = self.address.port();
        let named = ["127.0.0.1", "[::1]", "localhost"].map(|host| format!("{host}:{port}"));
        let [v4, v6, name] = named;
        [v4, v6, name, self.address.to_string()]
    }

    fn cookie_name(&self) -> String {
        format!("ferrodrive_studio_{}", self.address.port())
    }
}

/// Random, in hexadecimal digits.
///
/// # Errors
/// [`AccessError::NoRandom`].
pub(crate) fn secret() -> Result<String, AccessError> {
    let mut bytes = [0; SECRET_BYTES];
    getrandom::fill(&mut bytes).map_err(AccessError::NoRandom)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Compares in constant time.
pub(crate) fn is_same(a: &str, b: &str) -> bool {
    a.as_bytes().ct_eq(b.as_bytes()).into()
}

fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elsewhere_takes_a_password_that_is_not_short() {
        let elsewhere: SocketAddr = "0.0.0.0:8402".parse().expect("an address");
        assert!(matches!(Access::new(elsewhere, None), Err(AccessError::NoPassword(_))));
        assert!(matches!(Password::new("hunter2"), Err(AccessError::ShortPassword(7))));
        let password = Password::new("correct horse battery").expect("long enough");
        assert!(!format!("{password:?}").contains("horse"), "no secret in a log");
        let access = Access::new(elsewhere, Some(password)).expect("with a password");
        assert!(access.is_password("correct horse battery") && !access.is_password("correct horse batterz"));
        let here = Access::new("127.0.0.1:1".parse().expect("an address"), None).expect("loopback");
        assert!(!here.is_password(""), "without a password, none is right");
    }

    #[test]
    fn a_token_that_is_kept_lets_in_what_an_earlier_launch_let_in() {
        let address: SocketAddr = "127.0.0.1:8402".parse().expect("an address");
        for bad in ["", "0123456789abcdef0123456789abcde", "0123456789abcdef 0123456789abcdef", &"\u{e4}".repeat(32)] {
            assert!(matches!(Token::new(bad), Err(AccessError::BadToken)), "{bad}");
        }
        let token = Token::random().expect("random");
        let again = Token::new(token.text()).expect("what was made is taken");
        assert!(!format!("{token:?}").contains(token.text()), "no secret in a log");
        let launches = [token, again].map(|token| Access::new(address, None).expect("loopback").with_token(token));
        assert_eq!((launches[0].url(), launches[0].cookie()), (launches[1].url(), launches[1].cookie()));
        let mut headers = HeaderMap::new();
        let cookie = launches[0].cookie();
        headers.insert(COOKIE, cookie.split(';').next().expect("a pair").parse().expect("a header"));
        assert!(launches[1].lets_in(&headers));
        assert!(!Access::new(address, None).expect("loopback").lets_in(&headers), "without it none does");
    }

    #[test]
    fn each_launch_has_a_token_of_its_own() {
        let address: SocketAddr = "127.0.0.1:8402".parse().expect("an address");
        let [first, second] = [(); 2].map(|()| Access::new(address, None).expect("loopback"));
        assert_ne!(first.token, second.token);
        assert_ne!(first.token, first.pass);
        assert_eq!(first.url(), format!("http://127.0.0.1:8402/?token={}", first.token));
        assert_eq!(first.token.len(), 2 * SECRET_BYTES);
    }
}
