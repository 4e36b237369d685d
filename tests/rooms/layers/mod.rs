//! Rules that the order of the crates cannot enforce, over the text of the sources. Refused are
//! references that a room may not make, files of a crate or entries of a folder that use one
//! another in a circle, and files, threads, clock, environment or printing in a pure crate. Bounded
//! are long functions, flat folders, type names with several meanings or none, and patterns of
//! speech: a bound may only fall, and falls with its count. Comments, strings and inline tests are
//! no code.

mod bound;
mod circles;
mod names;
mod references;
mod rooms;
mod size;
mod source;
mod uses;
mod words;
