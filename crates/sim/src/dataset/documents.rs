//! The files beside the arrays of a data set: a data card for people, and the Croissant 1.0 description for programs.
//!
//! Check: mlcroissant reads the description without a warning (`python/tests/test_dataset.py`).

use super::plan::DatasetPlan;
use super::{PLAN, STORE};
use crate::io::zarr::{Array, METADATA, json_text};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

/// Date of the release of this program, which Croissant wants: files have no time of writing.
const RELEASED: &str = "2026-11-27";
/// The context of Croissant 1.0, as its specification prints it.
const CONTEXT: &str = include_str!("croissant_context.json");

/// The data card.
pub(super) fn readme(plan: &DatasetPlan, arrays: &[Array]) -> String {
    let keys = &plan.keys;
    let mut text = format!("# {}\n\n{}\n\n", keys.title, keys.description);
    text += &format!(
        "Simulated scans of a Doppler lidar with exact truth: {} flights at {} sites. Creator: {}. Licence: {}. {}\n\n",
        keys.flights(),
        keys.sites,
        keys.creator,
        keys.licence,
        keys.url
    );
    text += &format!(
        "Made by {}: `wakescope dataset {PLAN} --out DIR` makes the same bytes again. Read it with \
         `xarray.open_zarr(\"{STORE}\")`; flights are there where `ready` is 1.\n\n",
        crate::PROGRAM
    );
    text += "| array | axes | units | content |\n|---|---|---|---|\n";
    for array in arrays {
        let attribute = |name: &str| {
            array
                .attributes
                .get(name)
                .and_then(Value::as_str)
                .unwrap_or_default()
        };
        text += &format!(
            "| `{}` | {} | {} | {} |\n",
            array.name,
            array.dimensions.join(", "),
            attribute("units"),
            attribute("long_name")
        );
    }
    text
}

/// The Croissant description, with the hashes of the metadata of the group and of the plan.
pub(super) fn croissant(plan: &DatasetPlan, group: &str) -> String {
    let keys = &plan.keys;
    let file = |id: &str, description: &str, url: String, format: &str, content: &str| {
        json!({
            "@type": "cr:FileObject", "@id": id, "name": id, "description": description, "contentUrl": url,
            "encodingFormat": format, "sha256": sha256(content),
        })
    };
    let creator = match keys.creator.as_str() {
        "" => crate::PROGRAM,
        name => name,
    };
    let url = match keys.url.as_str() {
        "" => env!("CARGO_PKG_HOMEPAGE"),
        url => url,
    };
    let description = format!(
        "{} Simulated Doppler lidar scans of aircraft wake vortices with exact truth.",
        keys.description
    );
    let context: Value = serde_json::from_str(CONTEXT).unwrap_or_default();
    let about_store = format!("The Zarr v3 store: its root. xarray.open_zarr('{STORE}')");
    let document = json!({
        "@context": context,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": keys.title,
        "description": description.trim(),
        "license": format!("https://spdx.org/licenses/{}.html", keys.licence),
        "url": url,
        "version": "1.0.0",
        "datePublished": RELEASED,
        "creator": { "@type": "sc:Organization", "name": creator },
        "citeAs": format!("{creator}: {}", keys.title),
        "isLiveDataset": false,
        "distribution": [
            file("schema", &about_store, format!("{STORE}/{METADATA}"), "application/json", group),
            file("plan", "The plan that was drawn", PLAN.into(), "application/toml", &plan.text),
        ],
    });
    json_text(&document)
}

/// The SHA-256 of a text in hexadecimal digits.
fn sha256(text: &str) -> String {
    let mut digits = String::new();
    for byte in Sha256::digest(text.as_bytes()) {
        digits += &format!("{byte:02x}");
    }
    digits
}
