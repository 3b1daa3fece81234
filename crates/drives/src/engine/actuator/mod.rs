//! From a [`Demand`](super::axis::Demand) to duty cycles, and what a power stage is protected by.

pub mod bleeder;
pub mod observer;
pub mod overload;
pub mod servo;
pub mod stepper;
