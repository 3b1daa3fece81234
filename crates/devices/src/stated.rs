use canopen::Mux;

/// A departure that only words can say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stated {
    /// Its name for programs: `brake_is_manual`.
    pub key: &'static str,
    /// The object that it is about.
    pub object: Mux,
    /// What is so.
    pub what: &'static str,
    /// What a program written to the standard has to do.
    pub remedy: &'static str,
}
