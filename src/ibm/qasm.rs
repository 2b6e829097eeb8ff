//! A [`Circuit`] as OpenQASM 3 text that IBM's loader (qiskit's `qasm3` importer) accepts: physical
//! qubits `$n`, `stdgates.inc`, own definitions of `ecr` and `rzz`, `input float[64]` parameters, and
//! one measurement per qubit into `c`.

use std::fmt::Write;

use super::circuit::{Angle, Circuit, Gate};
use super::device::Entangler;

/// Equal to IBM's ECR up to a global phase; the loader only takes gates that are defined, and the device
/// recognises it by its name.
const ECR: &str = "gate ecr q0, q1 { s q0; sx q1; cx q0, q1; x q0; }\n";
const RZZ: &str = "gate rzz(t) q0, q1 { cx q0, q1; rz(t) q1; cx q0, q1; }\n";

impl Circuit {
    /// The program. Bit `c[i]` is qubit i of the chain.
    #[must_use]
    pub fn to_qasm(&self) -> String {
        let mut text = String::from("OPENQASM 3.0;\ninclude \"stdgates.inc\";\n");
        // Writing to a String cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        for parameter in self.parameters() {
            writeln!(text, "input float[64] {parameter};")?;
        }
        text.push_str(match self.line().native().entangler {
            Entangler::Ecr => ECR,
            Entangler::Rzz => RZZ,
            Entangler::Cz => "",
        });
        let qubits = self.line().qubits();
        writeln!(text, "bit[{}] c;", qubits.len())?;
        for gate in self.gates() {
            match gate {
                Gate::Rz(q, angle) => writeln!(text, "rz({}) {};", expression(angle), qubits[*q]),
                Gate::Rx(q, angle) => writeln!(text, "rx({}) {};", expression(angle), qubits[*q]),
                Gate::Sx(q) => writeln!(text, "sx {};", qubits[*q]),
                Gate::X(q) => writeln!(text, "x {};", qubits[*q]),
                Gate::Ecr(a, b) => writeln!(text, "ecr {}, {};", qubits[*a], qubits[*b]),
                Gate::Cz(a, b) => writeln!(text, "cz {}, {};", qubits[*a], qubits[*b]),
                Gate::Rzz(a, b, angle) => {
                    let angle = expression(angle);
                    writeln!(text, "rzz({angle}) {}, {};", qubits[*a], qubits[*b])
                }
            }?;
        }
        for (bit, qubit) in qubits.iter().enumerate() {
            writeln!(text, "c[{bit}] = measure {qubit};")?;
        }
        Ok(())
    }
}

/// `factor*parameter + … + constant`. Numbers are written so that they are read back exactly.
fn expression(angle: &Angle) -> String {
    let mut text = String::new();
    for (parameter, factor) in &angle.terms {
        let sign = if factor.is_sign_negative() {
            "-"
        } else if text.is_empty() {
            ""
        } else {
            "+"
        };
        let _ = write!(text, "{sign}{:?}*{parameter}", factor.abs());
    }
    if text.is_empty() || angle.constant != 0.0 {
        let sign = if angle.constant.is_sign_negative() || text.is_empty() { "" } else { "+" };
        let _ = write!(text, "{sign}{:?}", angle.constant);
    }
    text
}
