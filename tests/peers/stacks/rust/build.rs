//! Makes the object dictionary of the node from `zencan_config.toml`.

fn main() {
    if let Err(error) = zencan_build::build_node_from_device_config("ZENCAN_CONFIG", "zencan_config.toml") {
        panic!("zencan_config.toml: {error}");
    }
}
