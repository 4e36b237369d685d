//! Walls, slots and heads by contacts, however coarse the mesh is there.

pub mod contact_heads;
pub mod contact_slots;
pub mod contact_walls;
pub mod contacts;
