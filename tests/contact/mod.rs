//! Instruments that touch tissue: against closed forms, conservation of momentum, exact steps, and instruments that
//! nobody sane would move like this.

mod clearance;
mod closed_forms;
mod fields;
mod grips;
mod hand_speed;
mod line;
mod long_steps;
mod scene;
mod short_spans;
mod surface_fields;
mod thin;
mod touching;
