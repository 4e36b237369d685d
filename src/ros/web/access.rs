//! Who may see and who may do what: one-time links, cookies, roles, and the addresses by which the
//! page is called.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::own_addresses::own_addresses;
use crate::ros::locked;

/// Links and cookies that are known at a time; the oldest go first.
const MOST_KNOWN: usize = 64;

/// What a page may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// it is shown everything
    Look,
    /// it also changes things
    Operate,
}

/// A secret of 128 random bits, as 32 hexadecimal digits.
#[derive(Clone, Debug)]
pub(super) struct Secret(String);

impl Secret {
    /// A new one, of the system's generator.
    pub fn new() -> std::io::Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        Ok(Self(
            bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        ))
    }

    /// As it is sent.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Whether it is that; it takes as long for every other one of its length.
    fn is(&self, given: &str) -> bool {
        let pairs = self.0.bytes().zip(given.bytes());
        self.0.len() == given.len()
            && pairs.fold(0, |differing, (ours, theirs)| differing | (ours ^ theirs)) == 0
    }
}

/// Secrets with what they give, the oldest first.
type Known = VecDeque<(Secret, Role)>;

/// Who may do what.
#[derive(Debug)]
pub(super) struct Access {
    /// as it is listened to
    address: SocketAddr,
    /// the values of `Host` by which the page is called, beside the machine's own addresses where
    /// it is listened to at all of them
    hosts: Vec<String>,
    /// by which links call it
    names: Vec<String>,
    scheme: &'static str,
    /// without links everybody who reaches the address operates
    needs_cookie: bool,
    cookie_name: String,
    links: Mutex<Known>,
    cookies: Mutex<Known>,
}

impl Access {
    /// - `address`: to listen to.
    /// - `names`: other names and addresses of this machine by which the page may be called.
    /// - `by_link`: pages are let in by link alone.
    pub fn new(address: SocketAddr, names: &[String], by_link: bool, is_tls: bool) -> Self {
        let (scheme, usual) = if is_tls { ("https", 443) } else { ("http", 80) };
        let mut named: Vec<String> = names.to_vec();
        if address.ip().is_loopback() || address.ip().is_unspecified() {
            named.extend(["localhost", "127.0.0.1", "[::1]"].map(str::to_owned));
        }
        if !address.ip().is_unspecified() {
            named.push(in_a_link(address.ip()));
        }
        let port = address.port();
        let mut hosts: Vec<String> = named
            .iter()
            .map(|name| format!("{}:{port}", name.to_lowercase()))
            .collect();
        if port == usual {
            hosts.extend(named.iter().map(|name| name.to_lowercase()));
        }
        Self {
            address,
            hosts,
            names: names.to_vec(),
            scheme,
            needs_cookie: by_link,
            cookie_name: format!("touchup_{port}"),
            links: Mutex::default(),
            cookies: Mutex::default(),
        }
    }

    /// Whether the page is called by one of its own names: a name that somebody else's server
    /// answers for is none, whatever address it leads to.
    pub fn is_host(&self, host: &str) -> bool {
        self.hosts.contains(&host.to_lowercase()) || self.is_own_address(host)
    }

    /// Whether it is one that the machine has now, if all of them are listened to.
    fn is_own_address(&self, host: &str) -> bool {
        let own = self.address.ip();
        let usual = if self.scheme == "https" { 443 } else { 80 };
        let without_port = || {
            let ip = host.trim_start_matches('[').trim_end_matches(']');
            Some(SocketAddr::new(ip.parse().ok()?, usual))
        };
        let asked: Option<SocketAddr> = host.parse().ok().or_else(without_port);
        own.is_unspecified()
            && asked.is_some_and(|asked| {
                asked.port() == self.address.port() && own_addresses(own).contains(&asked.ip())
            })
    }

    /// The addresses of the page for links, as `http://192.168.0.7:8321`: by the given names first,
    /// and by each address that the machine has now if all are listened to.
    pub fn urls(&self) -> Vec<String> {
        let (ip, port) = (self.address.ip(), self.address.port());
        let mut names = self.names.clone();
        if ip.is_unspecified() {
            names.extend(own_addresses(ip).into_iter().map(in_a_link));
        }
        if names.is_empty() {
            names.push(match ip.is_unspecified() {
                true => "localhost".to_owned(),
                false => in_a_link(ip),
            });
        }
        names
            .iter()
            .map(|name| format!("{}://{name}:{port}", self.scheme))
            .collect()
    }

    /// Whether what asks was loaded from here: the value of `Origin`.
    pub fn is_origin(&self, origin: &str) -> bool {
        origin
            .split_once("://")
            .is_some_and(|(scheme, host)| scheme == self.scheme && self.is_host(host))
    }

    /// Whether a page has to be let in by a link.
    pub fn needs_cookie(&self) -> bool {
        self.needs_cookie
    }

    /// A new link: its secret, good for one page.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn invite(&self, role: Role) -> std::io::Result<Secret> {
        let secret = Secret::new()?;
        remember(&self.links, &secret, role);
        Ok(secret)
    }

    /// Uses a link up: the cookie to be set, with its name, and the role.
    ///
    /// # Errors
    /// Where the system has no random numbers.
    pub fn pair(&self, token: &str) -> std::io::Result<Option<(String, Role)>> {
        let used = {
            let mut links = locked(&self.links);
            let at = links.iter().position(|(secret, _)| secret.is(token));
            at.and_then(|at| links.remove(at))
        };
        let Some((_, role)) = used else {
            return Ok(None);
        };
        let cookie = Secret::new()?;
        remember(&self.cookies, &cookie, role);
        let secure = if self.scheme == "https" {
            "; Secure"
        } else {
            ""
        };
        let text = format!(
            "{}={}; HttpOnly; SameSite=Strict; Path=/; Max-Age=43200{secure}",
            self.cookie_name,
            cookie.text()
        );
        Ok(Some((text, role)))
    }

    /// What the value of `Cookie` gives; `None`: nothing.
    pub fn role(&self, cookies: &str) -> Option<Role> {
        if !self.needs_cookie {
            return Some(Role::Operate);
        }
        let pairs = cookies
            .split(';')
            .filter_map(|pair| pair.trim().split_once('='));
        let known = locked(&self.cookies);
        let ours = pairs.filter(|(name, _)| *name == self.cookie_name);
        let role = |value: &str| {
            known
                .iter()
                .find(|(secret, _)| secret.is(value))
                .map(|(_, role)| *role)
        };
        ours.into_iter().find_map(|(_, value)| role(value))
    }
}

fn remember(known: &Mutex<Known>, secret: &Secret, role: Role) {
    let mut known = locked(known);
    if known.len() == MOST_KNOWN {
        known.pop_front();
    }
    known.push_back((secret.clone(), role));
}

/// An address as links have it.
pub(super) fn in_a_link(ip: IpAddr) -> String {
    match ip {
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(address: &str) -> Access {
        let address: SocketAddr = address.parse().unwrap();
        Access::new(
            address,
            &["cell.local".to_owned()],
            !address.ip().is_loopback(),
            false,
        )
    }

    #[test]
    fn the_page_is_called_by_its_own_names_alone() {
        let loopback = access("127.0.0.1:8321");
        for host in [
            "127.0.0.1:8321",
            "localhost:8321",
            "LOCALHOST:8321",
            "[::1]:8321",
            "cell.local:8321",
        ] {
            assert!(loopback.is_host(host), "{host}");
            assert!(loopback.is_origin(&format!("http://{host}")), "{host}");
        }
        for host in [
            "localhost",
            "localhost:80",
            "evil.example:8321",
            "127.0.0.1:8321.evil.example",
            "",
            "null",
        ] {
            assert!(!loopback.is_host(host), "{host}");
        }
        for origin in [
            "null",
            "https://localhost:8321",
            "http://evil.example",
            "http://localhost:8321/",
            "localhost:8321",
        ] {
            assert!(!loopback.is_origin(origin), "{origin}");
        }
        let lan = access("192.168.0.7:80");
        assert!(
            lan.is_host("192.168.0.7")
                && lan.is_host("192.168.0.7:80")
                && !lan.is_host("127.0.0.1")
        );
    }

    #[test]
    fn where_all_addresses_are_listened_to_each_that_the_machine_has_is_its_name() {
        for [all, other] in [["0.0.0.0:80", "192.0.2.1"], ["[::]:80", "[2001:db8::1]"]] {
            let lan = access(all);
            let urls = lan.urls();
            assert_eq!(urls[0], "http://cell.local:80");
            for url in &urls {
                assert!(lan.is_origin(url), "{url}");
                assert!(lan.is_origin(url.trim_end_matches(":80")), "{url}");
                assert!(!lan.is_origin(&url.replace(":80", ":81")), "{url}");
            }
            let own = own_addresses(all.parse::<SocketAddr>().unwrap().ip());
            assert_eq!(urls.len(), 1 + own.len());
            assert!(!lan.is_host(other) && !lan.is_host(&format!("{other}:80")));
        }
        assert!(!access("127.0.0.1:80").is_own_address("127.0.0.1"));
    }

    #[test]
    fn a_link_lets_one_page_in_with_its_role() {
        let lan = access("0.0.0.0:8321");
        assert!(lan.needs_cookie() && lan.role("").is_none());
        let link = lan.invite(Role::Look).unwrap();
        assert!(lan.pair("0123").unwrap().is_none());
        let (cookie, role) = lan.pair(link.text()).unwrap().unwrap();
        assert!(lan.pair(link.text()).unwrap().is_none(), "it is used up");
        assert_eq!(role, Role::Look);
        assert!(
            cookie.contains("; HttpOnly; SameSite=Strict") && !cookie.contains("Secure"),
            "{cookie}"
        );
        let sent = cookie.split(';').next().unwrap();
        assert_eq!(lan.role(&format!("other=1; {sent}")), Some(Role::Look));
        assert_eq!(lan.role(&sent.replace("touchup_8321", "touchup_1")), None);
        assert_eq!(lan.role(&format!("{sent}0")), None);
    }

    #[test]
    fn links_and_cookies_are_bounded_and_the_oldest_go() {
        let lan = access("0.0.0.0:8321");
        let first = lan.invite(Role::Operate).unwrap();
        for _ in 0..MOST_KNOWN {
            lan.invite(Role::Look).unwrap();
        }
        assert!(lan.pair(first.text()).unwrap().is_none());
        assert_eq!(locked(&lan.links).len(), MOST_KNOWN);
    }

    #[test]
    fn where_no_link_is_needed_everybody_operates() {
        assert_eq!(access("127.0.0.1:8321").role(""), Some(Role::Operate));
    }
}
