mod arm;
mod files;
mod samples;
