mod arm;
mod cell;
mod files;
mod samples;
mod stops;
mod take_out;
mod truth;
