mod arm;
mod cell;
mod samples;
mod stops;
mod take_out;
mod truth;
