//! Authorisation of pages: one-time links, cookies, roles, and the host names of the page.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::own_addresses::own_addresses;
use crate::ros::locked;

/// Maximum number of stored links, and of stored cookies; the oldest go first.
const MOST_KNOWN: usize = 64;

/// Permission of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// view everything
    Look,
    /// also change things
    Operate,
}

/// A secret of 128 random bits, as 32 hexadecimal digits.
#[derive(Clone, Debug)]
pub(in crate::page) struct Secret(String);

impl Secret {
    /// A new secret from the random number generator of the system.
    pub fn new() -> std::io::Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
        Ok(Self(
            bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        ))
    }

    /// The 32 hexadecimal digits.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Equality, in constant time for texts of the same length.
    fn is(&self, given: &str) -> bool {
        let pairs = self.0.bytes().zip(given.bytes());
        self.0.len() == given.len()
            && pairs.fold(0, |differing, (ours, theirs)| differing | (ours ^ theirs)) == 0
    }
}

/// Secrets and their roles, the oldest first.
type SecretRoles = VecDeque<(Secret, Role)>;

/// Authorisation of pages.
#[derive(Debug)]
pub(in crate::page) struct Access {
    /// listening address
    address: SocketAddr,
    /// accepted values of `Host`; at an unspecified address also the machine's own addresses
    hosts: Vec<String>,
    /// host names in links
    names: Vec<String>,
    scheme: &'static str,
    /// without links everybody who reaches the address operates
    needs_cookie: bool,
    cookie_name: String,
    links: Mutex<SecretRoles>,
    cookies: Mutex<SecretRoles>,
}

impl Access {
    /// - `address`: the listening address.
    /// - `names`: further host names and addresses of the page.
    /// - `by_link`: pages need a link.
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

    /// Whether `Host` is a name of the page. A name on another's server is not, whatever address it
    /// resolves to.
    pub fn is_host(&self, host: &str) -> bool {
        self.hosts.contains(&host.to_lowercase()) || self.is_own_address(host)
    }

    /// Whether the host is a present address of the machine; only at an unspecified listening
    /// address.
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

    /// URLs of the page for links, as `http://192.168.0.7:8321`: by each given name first, then, at
    /// an unspecified listening address, by each present address of the machine.
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

    /// Whether `Origin` is this page.
    pub fn is_origin(&self, origin: &str) -> bool {
        origin
            .split_once("://")
            .is_some_and(|(scheme, host)| scheme == self.scheme && self.is_host(host))
    }

    /// Whether pages need a link.
    pub fn needs_cookie(&self) -> bool {
        self.needs_cookie
    }

    /// A new link: its secret, valid for one page.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn invite(&self, role: Role) -> std::io::Result<Secret> {
        let secret = Secret::new()?;
        remember(&self.links, &secret, role);
        Ok(secret)
    }

    /// Consumes a link: the `Set-Cookie` value and the role.
    ///
    /// # Errors
    /// If the system has no random numbers.
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

    /// Role of a `Cookie` header; `None`: no valid cookie.
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

fn remember(known: &Mutex<SecretRoles>, secret: &Secret, role: Role) {
    let mut known = locked(known);
    if known.len() == MOST_KNOWN {
        known.pop_front();
    }
    known.push_back((secret.clone(), role));
}

/// Host part of a URL: an IPv6 address in brackets.
pub(in crate::page) fn in_a_link(ip: IpAddr) -> String {
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
