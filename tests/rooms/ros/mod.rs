mod arguments;
mod messages;
mod parameters;
