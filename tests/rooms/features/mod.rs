mod command;
mod curvature;
mod detection;
mod files;
mod fit;
mod form;
mod touched;
mod track;
