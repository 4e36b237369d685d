//! The dashboard of a UR, on a connection of its own: it stops the arm without Python and without a
//! program.

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::error::UrError;
use touchup_probing::arm::Safety;

/// TCP port of the dashboard.
const PORT: u16 = 29999;
/// End of the greeting of a simulated controller in lock step with its client. No robot sends it.
const LOCK_STEP: &str = "in lock step";

/// A connection to a dashboard.
pub(super) struct Dashboard {
    host: String,
    replies: BufReader<TcpStream>,
    /// whether this is a simulated controller whose clock waits for its client
    pub is_lock_step: bool,
    /// whether an answer was late, as opposed to a closed connection
    pub is_silent: bool,
}

impl Dashboard {
    /// Connects and waits for the greeting.
    ///
    /// - `deadline`: for this and for each answer.
    pub fn connect(host: &str, deadline: Duration) -> Result<Self, UrError> {
        let socket = socket(host, PORT, "dashboard", deadline)?;
        let mut dashboard = Self {
            host: host.to_owned(),
            replies: BufReader::new(socket),
            is_lock_step: false,
            is_silent: false,
        };
        dashboard.is_lock_step = dashboard.line()?.ends_with(LOCK_STEP);
        Ok(dashboard)
    }

    fn unreachable(&self, reason: impl ToString) -> UrError {
        UrError::Unreachable {
            host: self.host.clone(),
            port: PORT,
            service: "dashboard",
            reason: reason.to_string(),
        }
    }

    fn line(&mut self) -> Result<String, UrError> {
        let mut line = String::new();
        match self.replies.read_line(&mut line) {
            Ok(0) => Err(self.unreachable("it closed the connection")),
            Ok(_) => Ok(line.trim().to_owned()),
            Err(error) => {
                self.is_silent =
                    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut);
                Err(self.unreachable(error))
            }
        }
    }

    fn ask(&mut self, what: &str) -> Result<String, UrError> {
        let sent = self
            .replies
            .get_mut()
            .write_all(format!("{what}\n").as_bytes());
        sent.map_err(|error| self.unreachable(error))?;
        self.line()
    }

    /// Whether the connection is open; a silent one counts as open.
    pub fn is_open(&mut self) -> bool {
        let socket = self.replies.get_ref();
        let look = || {
            socket.set_nonblocking(true)?;
            let seen = socket.peek(&mut [0]);
            socket.set_nonblocking(false)?;
            seen
        };
        match look() {
            Ok(count) => count > 0,
            Err(error) => error.kind() == ErrorKind::WouldBlock,
        }
    }

    /// Stops the program of the controller, and the arm with it.
    pub fn stop(&mut self) -> Result<(), UrError> {
        let answer = self.ask("stop")?;
        // a program that has already ended cannot be stopped
        if answer == "Stopped" || self.ask("programState")?.starts_with("STOPPED") {
            return Ok(());
        }
        Err(self.unreachable(format!("`stop` was answered by `{answer}`")))
    }

    /// Checks that the controller takes orders from outside.
    pub fn check_remote(&mut self) -> Result<(), UrError> {
        let answer = self.ask("is in remote control")?;
        if answer == "true" {
            Ok(())
        } else {
            Err(UrError::Local {
                host: self.host.clone(),
            })
        }
    }

    /// Checks that the arm has power and its brakes are open.
    pub fn check_power(&mut self) -> Result<(), UrError> {
        let mode = self.ask("robotmode")?;
        let is_running = mode.ends_with("RUNNING");
        if is_running {
            Ok(())
        } else {
            Err(UrError::Off {
                host: self.host.clone(),
                mode,
            })
        }
    }

    /// Status of the safety system.
    pub fn safety(&mut self) -> Result<Safety, UrError> {
        let answer = self.ask("safetystatus")?;
        let status = answer.rsplit(' ').next().unwrap_or_default();
        Ok(match status {
            "NORMAL" | "REDUCED" => Safety::Normal,
            "PROTECTIVE_STOP" => Safety::ProtectiveStop,
            "ROBOT_EMERGENCY_STOP" | "SYSTEM_EMERGENCY_STOP" | "SAFEGUARD_STOP" => {
                Safety::OperatorStop
            }
            _ if status.contains("SAFEGUARD") => Safety::OperatorStop,
            _ => Safety::Fault,
        })
    }

    /// Ends a protective stop; returns whether the controller complied.
    pub fn unlock(&mut self) -> Result<bool, UrError> {
        // the panel keeps the stop while its message is open
        self.ask("close safety popup")?;
        Ok(self.ask("unlock protective stop")? == "Protective stop releasing")
    }
}

/// A connection whose reads and writes end after the deadline.
pub(super) fn socket(
    host: &str,
    port: u16,
    service: &'static str,
    deadline: Duration,
) -> Result<TcpStream, UrError> {
    let connect = || {
        let mut last = std::io::Error::other("the name has no address");
        for address in (host, port).to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, deadline) {
                Ok(socket) => {
                    socket.set_read_timeout(Some(deadline))?;
                    socket.set_write_timeout(Some(deadline))?;
                    socket.set_nodelay(true)?;
                    return Ok(socket);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    };
    connect().map_err(|error: std::io::Error| UrError::Unreachable {
        host: host.to_owned(),
        port,
        service,
        reason: error.to_string(),
    })
}

#[cfg(test)]
pub(super) mod tests {
    use std::net::TcpListener;

    use super::PORT;

    /// Listens as a dashboard of a test, on an address of its own.
    pub fn listen() -> (String, TcpListener) {
        let host = |number: u8| format!("127.9.{}.{number}", std::process::id() % 250 + 1);
        let free = |host: String| {
            TcpListener::bind((host.as_str(), PORT))
                .ok()
                .map(|listener| (host, listener))
        };
        (1..250).map(host).find_map(free).unwrap()
    }
}
