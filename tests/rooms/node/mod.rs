mod arm;
mod samples;
