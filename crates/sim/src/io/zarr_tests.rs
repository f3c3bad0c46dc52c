use super::*;

/// A store of two flights a chunk, of which the first chunk is written.
fn store(root: &Path) -> Store {
    let axes = [("flight", 5), ("line", 2)];
    let velocity = Array::new("velocity", "int16", &axes, 2)
        .unwrap()
        .packed(0.005, 0.0, -32_768);
    let spectrum = Array::new("spectrum", "uint8", &axes, 1)
        .unwrap()
        .packed(0.25, -12.0, 0);
    let place = Array::new("vortex_y", "float64", &axes[..1], 2).unwrap();
    let seed = Array::new("seed", "uint64", &axes[..1], 2).unwrap();
    let mut attributes = Map::new();
    attributes.insert("seed".into(), json!(3));
    let writer = Writer::new(root).unwrap();
    let put = |key: &str, content: &[u8]| writer.put(key, content).unwrap();
    let mut bytes = Vec::new();
    velocity.pack([1.2374, -1.2376, f64::NAN, 1e6], &mut bytes);
    put(&velocity.chunk_key(0), &compressed(&bytes));
    bytes.clear();
    spectrum.pack([-12.0, 60.0], &mut bytes);
    put(&spectrum.chunk_key(1), &compressed(&bytes));
    bytes.clear();
    place.pack([-0.1, f64::NAN], &mut bytes);
    put(&place.chunk_key(0), &compressed(&bytes));
    let seeds = [u64::MAX.to_le_bytes(), 7_u64.to_le_bytes()].concat();
    put(&seed.chunk_key(0), &compressed(&seeds));
    let arrays = [velocity, spectrum, place, seed];
    put(
        METADATA,
        json_text(&group_json(&attributes, &arrays)).as_bytes(),
    );
    Store::open(root).unwrap()
}

#[test]
fn values_come_back_within_half_a_step_and_absent_chunks_are_missing() {
    let temp = tempfile::tempdir().unwrap();
    let store = store(&temp.path().join("scans.zarr"));
    assert_eq!(store.attributes["seed"], 3);
    let velocity = store.values("velocity", 0..5).unwrap();
    assert_eq!(velocity.shape(), [5, 2]);
    assert!((velocity[[0, 0]] - 1.235).abs() < 1e-12);
    assert!((velocity[[0, 1]] + 1.24).abs() < 1e-12);
    assert!(velocity[[1, 0]].is_nan());
    // What is too large has the largest code, never that of a missing value.
    assert!((velocity[[1, 1]] - 32_767.0 * 0.005).abs() < 1e-9);
    assert!(velocity.iter().skip(4).all(|value| value.is_nan()));
    assert_eq!(
        store.values("velocity", 1..2).unwrap()[[0, 1]],
        velocity[[1, 1]]
    );
    let spectrum = store.values("spectrum", 1..2).unwrap();
    assert_eq!(spectrum.as_slice().unwrap(), [-11.75, 51.75]);
    let place = store.values("vortex_y", 0..3).unwrap();
    assert!(place[0] == -0.1 && place[1].is_nan() && place[2].is_nan());
    let seed = store.integers("seed", 0..3).unwrap();
    assert_eq!(seed.as_slice().unwrap(), [-1, 7, 0]);
    assert_eq!(seed[0] as u64, u64::MAX);
}

#[test]
fn chunks_have_the_same_bytes_and_no_time() {
    let bytes = compressed(&[1, 2, 3]);
    assert_eq!(bytes, compressed(&[1, 2, 3]));
    // RFC 1952: flags, then four bytes of time.
    assert_eq!(&bytes[3..8], [0; 5]);
}

#[test]
fn damaged_chunks_and_foreign_metadata_are_refused_with_their_path() {
    let temp = tempfile::tempdir().unwrap();
    let store = store(&temp.path().join("scans.zarr"));
    let path = store.root.join("velocity/c/0/0");
    let whole = fs::read(&path).unwrap();
    let mut turned = whole.clone();
    turned[15] ^= 0x10;
    let longer = compressed(&[0; 10]);
    for damaged in [
        &whole[..whole.len() - 4],
        &whole[..5],
        &turned,
        &longer,
        &[],
    ] {
        fs::write(&path, damaged).unwrap();
        let message = store.values("velocity", 0..1).unwrap_err().to_string();
        assert!(message.contains("velocity/c/0/0"), "{message}");
    }
    for wrong in ["none", "vortex_y"] {
        assert!(store.integers(wrong, 0..1).is_err());
    }
    let rows = store.values("velocity", 4..6).unwrap_err().to_string();
    assert!(rows.contains("has 5 entries"), "{rows}");
    let path = store.root.join(METADATA);
    let text = fs::read_to_string(&path).unwrap();
    for (from, to, wanted) in [
        ("\"gzip\"", "\"zstd\"", "codecs"),
        ("\"int16\"", "\"int15\"", "data_type"),
        ("\"group\"", "\"array\"", "not a Zarr v3 group"),
        ("\"shape\"", "\"shap\"", "no shape"),
        (
            "\"separator\": \"/\"",
            "\"separator\": \".\"",
            "chunk_key_encoding",
        ),
        ("{", "", "not valid JSON"),
        ("\"dimension_names\"", "\"names\"", "dimension_names"),
        ("5,", "18446744073709551615,", "no memory"),
    ] {
        fs::write(&path, text.replace(from, to)).unwrap();
        let message = Store::open(&store.root).unwrap_err().to_string();
        assert!(
            message.contains("zarr.json") && message.contains(wanted),
            "{message}"
        );
    }
}

#[test]
fn metadata_name_the_codecs_and_the_dimensions() {
    let axes = [("flight", 64), ("scan", 16)];
    let array = Array::new("velocity", "int16", &axes, 16)
        .unwrap()
        .packed(0.005, 0.0, -32_768)
        .with("units", "m s-1");
    let json = array.to_json();
    assert_eq!(
        json["chunk_grid"]["configuration"]["chunk_shape"],
        json!([16, 16])
    );
    assert_eq!(json["codecs"][0]["configuration"]["endian"], "little");
    assert_eq!(json["fill_value"], -32_768);
    assert_eq!(json["dimension_names"], json!(["flight", "scan"]));
    assert_eq!(Array::from_json("velocity", &json), Ok(array));
    let float = Array::new("wind_x", "float64", &axes, 16)
        .unwrap()
        .to_json();
    assert_eq!(float["fill_value"], "NaN");
    assert!(float["attributes"].get("_FillValue").is_none());
}

#[test]
fn a_file_is_there_whole_or_not_at_all_and_stages_are_beside_the_group() {
    let temp = tempfile::tempdir().unwrap();
    let root = temp.path().join("scans.zarr");
    let writer = Writer::new(&root).unwrap();
    writer.put("velocity/c/0", b"first").unwrap();
    writer.put("velocity/c/0", b"second").unwrap();
    // A file in the way of a folder.
    writer.put("ready", b"").unwrap();
    let message = writer.put("ready/c/0", b"1").unwrap_err().to_string();
    assert!(message.contains("ready/c/0"), "{message}");
    drop(writer);
    assert_eq!(fs::read(root.join("velocity/c/0")).unwrap(), b"second");
    assert_eq!(fs::read_dir(temp.path()).unwrap().count(), 1);
}
