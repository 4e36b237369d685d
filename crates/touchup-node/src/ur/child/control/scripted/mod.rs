//! The whole chain in one process and one thread: a watched arm, orders, driver, library, the model
//! of the controller that the stand-in puts on the wire, states, guard and dashboard. All follow
//! the clock of the model, and a script times the faults.
//!
//! The judge is the model's own record. While the driver is in a call of its library the caller
//! orders nothing.

mod chain;
mod faults;
mod hours;
mod live_bytes;
mod session;
