mod kinematics;
mod touching;
mod turned_slots;
