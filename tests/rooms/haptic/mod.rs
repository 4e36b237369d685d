mod counted;
mod dynamics;
mod formulas;
mod push;
mod registration;
mod sweeps;
