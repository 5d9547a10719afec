//! oxictl's online identification of a PMSM (two recursive least squares) on logs: `oxictl R Ld Lq psi` in SI, one line a log.
//!
//! It takes no start values: its weights begin at zero. In its favour:
//! - forgetting 1 instead of its default 0.97, which loses all parameters to noise; on smoothed rows 0.9999, since there the error of its start,
//!   when the axes do not know each other's inductance, lasts too long;
//! - the voltage of the row before, which is the one that its backward difference of the currents needs;
//! - double precision.
//!
//! Environment: SMOOTH=N feeds it moving means over N rows.
use oxictl::motor::param_id::pmsm_id::{PmsmIdConfig, PmsmParamId};
use std::{env, error::Error, fs, process};

const POLE_PAIRS: f64 = 4.0;
const FORGETTING: f64 = 1.0;
const FORGETTING_SMOOTHED: f64 = 0.9999;
const COLUMNS: [&str; 6] = ["t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s"];

type Row = [f64; COLUMNS.len()];

fn load(path: &str) -> Result<Vec<Row>, Box<dyn Error>> {
    let text = fs::read_to_string(path)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().ok_or("empty")?.split(',').map(str::trim).collect();
    let mut at = [0; COLUMNS.len()];
    for (place, name) in at.iter_mut().zip(COLUMNS) {
        *place = header.iter().position(|h| *h == name).ok_or(format!("no column {name}"))?;
    }
    let mut rows = Vec::new();
    for line in lines.filter(|l| !l.is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        let mut row = Row::default();
        for (value, place) in row.iter_mut().zip(at) {
            *value = cells.get(place).ok_or("short row")?.trim().parse()?;
        }
        rows.push(row);
    }
    Ok(rows)
}

fn smoothed(rows: &[Row], n: usize) -> Vec<Row> {
    let mean = |window: &[Row]| {
        let mut m = Row::default();
        for row in window {
            for (sum, value) in m.iter_mut().zip(row) {
                *sum += value / n as f64;
            }
        }
        m
    };
    rows.windows(n).map(mean).collect()
}

fn identify(path: &str, smooth: usize) -> Result<[f64; 4], Box<dyn Error>> {
    let rows = smoothed(&load(path)?, smooth);
    if rows.len() < 2 {
        return Err("too few rows".into());
    }
    let dt = (rows[rows.len() - 1][0] - rows[0][0]) / (rows.len() - 1) as f64;
    let mut config = PmsmIdConfig::default_config();
    config.forgetting_factor = if smooth > 1 { FORGETTING_SMOOTHED } else { FORGETTING };
    let mut peer = PmsmParamId::new(dt, config);
    for pair in rows.windows(2) {
        let ([_, v_d, v_q, ..], [_, _, _, i_d, i_q, w]) = (pair[0], pair[1]);
        peer.update(v_d, v_q, i_d, i_q, POLE_PAIRS * w);
    }
    let found = peer.results();
    Ok([found.rs, found.ld, found.lq, found.lambda_pm])
}

fn main() {
    let smooth = env::var("SMOOTH").ok().and_then(|n| n.parse().ok()).unwrap_or(1).max(1);
    for path in env::args().skip(1) {
        match identify(&path, smooth) {
            Ok(found) => {
                let text: Vec<String> = found.iter().map(|x| if x.is_finite() { format!("{x:.6e}") } else { "-".into() }).collect();
                println!("oxictl {}", text.join(" "));
            }
            Err(why) => {
                eprintln!("{path}: {why}");
                process::exit(1);
            }
        }
    }
}
