mod edit;
mod journal;
mod queries;
mod simplified;
