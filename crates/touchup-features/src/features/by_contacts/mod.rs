//! Walls, slots and heads by contacts, however coarse the mesh is there.

pub(super) mod contact_heads;
pub(super) mod contact_slots;
pub(super) mod contact_walls;
pub(super) mod contacts;
