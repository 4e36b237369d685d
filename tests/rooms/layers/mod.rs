//! Rules that the order of the crates cannot enforce: reads the sources and fails on a reference
//! that a room may not make, on files of a crate or entries of a folder that use one another in a
//! circle, and on files, threads, clock, environment or printing in a crate that is pure. Comments,
//! strings and inline tests do not count.

mod circles;
mod references;
mod rooms;
mod source;
mod uses;
