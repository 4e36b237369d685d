mod command;
mod identification;
