mod command;
mod curvature;
mod detection;
mod files;
mod fit;
mod touched;
mod track;
