mod deviation;
mod disagreement;
