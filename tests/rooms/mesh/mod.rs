mod edit;
mod journal;
mod queries;
