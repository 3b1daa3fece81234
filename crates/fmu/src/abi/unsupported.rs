//! Functions of FMI for what these FMUs do not have. An importer finds all of them, and an error where it calls one.

use std::ffi::c_void;

use super::status::FmiStatus;
use super::{call, wrong};

/// Functions of an instance that end with an error. What stands behind the first argument is not looked at.
macro_rules! unsupported {
    ($($name:ident: $($argument:ty),*;)*) => {
        $(
            #[doc = concat!("`", stringify!($name), "`: an error, as the description of the model does not offer it.")]
            #[unsafe(no_mangle)]
            pub extern "C" fn $name(handle: *mut c_void, $(_: $argument),*) -> FmiStatus {
                call(handle, |_| wrong(concat!(stringify!($name), " is not offered by this FMU")))
            }
        )*
    };
}

/// Any pointer.
type P = *const c_void;

// Adding a function to this list that takes an argument costs no more than its types: widths decide how C hands them over.
unsupported! {
    fmi3GetNumberOfVariableDependencies: u32, P;
    fmi3GetVariableDependencies: u32, P, P, P, P, usize;
    fmi3GetDirectionalDerivative: P, usize, P, usize, P, usize, P, usize;
    fmi3GetAdjointDerivative: P, usize, P, usize, P, usize, P, usize;
    fmi3EnterConfigurationMode: ;
    fmi3ExitConfigurationMode: ;
    fmi3GetShiftDecimal: P, usize, P;
    fmi3GetShiftFraction: P, usize, P, P;
    fmi3SetIntervalDecimal: P, usize, P;
    fmi3SetIntervalFraction: P, usize, P, P;
    fmi3SetShiftDecimal: P, usize, P;
    fmi3SetShiftFraction: P, usize, P, P;
    fmi3EnterContinuousTimeMode: ;
    fmi3CompletedIntegratorStep: u8, P, P;
    fmi3SetTime: f64;
    fmi3SetContinuousStates: P, usize;
    fmi3GetContinuousStateDerivatives: P, usize;
    fmi3GetEventIndicators: P, usize;
    fmi3GetContinuousStates: P, usize;
    fmi3GetNominalsOfContinuousStates: P, usize;
    fmi3GetNumberOfEventIndicators: P;
    fmi3GetNumberOfContinuousStates: P;
    fmi3GetOutputDerivatives: P, usize, P, P, usize;
    fmi3ActivateModelPartition: u32, f64;
}

/// `fmi3InstantiateModelExchange`: null, as these FMUs are for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(_: P, _: P, _: P, _: u8, _: u8, _: P, _: P) -> *mut c_void {
    std::ptr::null_mut()
}

/// `fmi3InstantiateScheduledExecution`: null, as these FMUs are for co-simulation.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _: P,
    _: P,
    _: P,
    _: u8,
    _: u8,
    _: P,
    _: P,
    _: P,
    _: P,
    _: P,
) -> *mut c_void {
    std::ptr::null_mut()
}

// FMI 2.0: steps are never pending, and derivatives of inputs and outputs are not offered.
unsupported! {
    fmi2GetDirectionalDerivative: P, usize, P, usize, P, P;
    fmi2SetRealInputDerivatives: P, usize, P, P;
    fmi2GetRealOutputDerivatives: P, usize, P, P;
    fmi2CancelStep: ;
    fmi2GetStatus: i32, P;
    fmi2GetRealStatus: i32, P;
    fmi2GetIntegerStatus: i32, P;
    fmi2GetBooleanStatus: i32, P;
    fmi2GetStringStatus: i32, P;
}
