mod counted;
mod dense;
mod dynamics;
mod formulas;
mod push;
mod registration;
mod sweeps;
