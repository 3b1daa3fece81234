//! Physics against closed forms. One program: a file each.

mod attachment;
mod coupled;
mod current_loop;
mod driven_stepper;
mod external;
mod free_run;
mod gear;
mod hub_motor;
mod joint_motor;
mod mechanics;
mod pmsm;
mod servo_motor;
mod stepper;
mod stepper_motor;
