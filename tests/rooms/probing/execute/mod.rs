mod command;
mod planning;
mod sliding;
