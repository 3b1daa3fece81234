//! How long a file takes to load. The bar: 0.3 ms for a file of 193 objects.
//!
//! `FERRODRIVE_EDS_FILES` may name a folder with files of makers, which are then measured too.

use std::fmt::Write;
use std::fs;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use eds::Eds;
use eds::document::Document;

/// As large as a drive's: `objects` objects, every fourth a record of four sub-objects.
fn file(objects: u16) -> String {
    let mut text =
        String::from("[FileInfo]\nFileName=bench.eds\nFileVersion=1\n[DeviceInfo]\nVendorName=Bench\nBaudRate_500=1\n");
    let _ = write!(text, "[ManufacturerObjects]\nSupportedObjects={objects}\n");
    for at in 0..objects {
        let _ = writeln!(text, "{}=0x{:04X}", at + 1, 0x2000 + at);
    }
    for at in 0..objects {
        let index = 0x2000 + at;
        let values = "AccessType=rw\nDefaultValue=0x1234\nPDOMapping=1\nLowLimit=0\nHighLimit=65535\n\n";
        if at % 4 > 0 {
            let _ =
                write!(text, "[{index:04X}]\nParameterName=Parameter {at}\nObjectType=0x7\nDataType=0x0006\n{values}");
            continue;
        }
        let _ = write!(text, "[{index:04X}]\nParameterName=Record {at}\nObjectType=0x9\nSubNumber=5\n\n");
        let _ = write!(
            text,
            "[{index:04X}sub0]\nParameterName=Count\nObjectType=0x7\nDataType=0x0005\nAccessType=ro\nDefaultValue=4\nPDOMapping=0\n\n"
        );
        for sub in 1..5 {
            let _ = write!(
                text,
                "[{index:04X}sub{sub}]\nParameterName=Entry {sub}\nObjectType=0x7\nDataType=0x0006\n{values}"
            );
        }
    }
    text
}

fn load(criterion: &mut Criterion) {
    let text = file(193);
    let mut group = criterion.benchmark_group("eds");
    group.bench_function("lines/193_objects", |bench| bench.iter(|| Document::parse(black_box(text.as_bytes()))));
    group.bench_function("load/193_objects", |bench| bench.iter(|| Eds::load(black_box(text.as_bytes()))));
    let Some(folder) = std::env::var_os("FERRODRIVE_EDS_FILES") else { return };
    let mut paths: Vec<_> = fs::read_dir(folder).expect("the folder").flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let bytes = fs::read(&path).expect("a readable file");
        group.bench_function(format!("load/{name}"), |bench| bench.iter(|| Eds::load(black_box(&bytes))));
    }
}

criterion_group!(benches, load);
criterion_main!(benches);
