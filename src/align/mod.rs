//! Where a part lies: the rigid motion that brings one shape onto another.
