mod kinematics;
mod touching;
