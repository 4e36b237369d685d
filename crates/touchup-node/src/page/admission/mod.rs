//! Admission of pages: addresses, links, roles, and limits of connections.

pub mod access;
pub mod entrance;
pub mod listener;
pub mod own_addresses;
