mod kinematics;
mod serial_chain;
mod touching;
mod turned_slots;
