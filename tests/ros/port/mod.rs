mod arguments;
mod definitions;
mod messages;
mod parameters;
