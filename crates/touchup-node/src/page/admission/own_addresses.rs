//! Addresses of this machine for other machines.

use std::net::{IpAddr, UdpSocket};

use nix::ifaddrs::getifaddrs;

/// Addresses of a server at `unspecified` for other machines, that on the route to other networks
/// first: IPv4 alone, or with `::` both. Link-local addresses are left out, as browsers refuse
/// them.
pub(in crate::page) fn own_addresses(unspecified: IpAddr) -> Vec<IpAddr> {
    let interfaces = getifaddrs().map(Vec::from_iter).unwrap_or_default();
    let addresses = interfaces.iter().filter_map(|interface| {
        let address = interface.address.as_ref()?;
        let v4 = address.as_sockaddr_in().map(|v4| IpAddr::V4(v4.ip()));
        v4.or_else(|| Some(IpAddr::V6(address.as_sockaddr_in6()?.ip())))
    });
    let is_reached = |ip: &IpAddr| {
        let is_of_one_link = match ip {
            IpAddr::V4(ip) => ip.is_link_local(),
            IpAddr::V6(ip) => ip.is_unicast_link_local(),
        };
        (unspecified.is_ipv6() || ip.is_ipv4()) && !ip.is_loopback() && !is_of_one_link
    };
    let mut addresses: Vec<_> = addresses.filter(is_reached).collect();
    let way_out = way_out();
    addresses.sort_by_key(|ip| (Some(*ip) != way_out, ip.is_ipv6(), *ip));
    addresses.dedup();
    addresses
}

/// Own address on the route to other networks; sends nothing.
fn way_out() -> Option<IpAddr> {
    // of a documentation block (RFC 5737)
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    socket.connect("192.0.2.1:9").ok()?;
    Some(socket.local_addr().ok()?.ip())
}
