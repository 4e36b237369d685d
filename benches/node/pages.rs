//! Clients of the operator's page for the bench: one that reads as fast as it can, and one that
//! never reads.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread::spawn;

/// Opens the socket of a page.
fn opened(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).expect("the page is served");
    let lines = [
        "GET /ws HTTP/1.1".to_owned(),
        format!("Host: {address}"),
        format!("Origin: http://{address}"),
        "Connection: Upgrade".to_owned(),
        "Upgrade: websocket".to_owned(),
        "Sec-WebSocket-Version: 13".to_owned(),
        "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==".to_owned(),
        "Sec-WebSocket-Protocol: touchup.v1".to_owned(),
    ];
    stream
        .write_all((lines.join("\r\n") + "\r\n\r\n").as_bytes())
        .expect("the page listens");
    stream
}

/// A page that reads everything until the server ends.
pub fn reading(address: SocketAddr) {
    let mut stream = opened(address);
    spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        while stream.read(&mut buffer).is_ok_and(|count| count > 0) {}
    });
}

/// A page that never reads; it lives as long as the returned stream.
pub fn stuck(address: SocketAddr) -> TcpStream {
    opened(address)
}
