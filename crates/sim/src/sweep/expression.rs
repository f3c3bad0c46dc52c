//! Arithmetic on keys: sums, differences, products, quotients and powers of numbers and named values, and comparisons of two.
//!
//! `^` binds before the sign and from the right, as in mathematics. Check: values by hand; every slip is refused with its place.

/// Values of the names in an expression. Without them all numbers are missing, and nothing but the text can be wrong.
pub(crate) type Values<'v> = Option<&'v dyn Fn(&str) -> Result<f64, String>>;

/// Deepest nesting of an expression; a bracket behind an operator counts twice.
const DEEPEST: usize = 200;
/// Most operators of an expression.
const MOST_OPERATORS: usize = 1000;
/// Operators by how tightly they bind.
const BINDING: [&[char]; 3] = [&['+', '-'], &['*', '/'], &['^']];
/// Of these a sign holds for powers alone: -2^2 is -4.
const SIGN: usize = 2;

/// The value of an expression.
///
/// # Errors
/// What is wrong in the text, and where; what `values` says of a name; a division by zero; numbers that give none. What is missing
/// (NaN) stays so.
pub(crate) fn value(text: &str, values: Values<'_>) -> Result<f64, String> {
    let parser = Parser {
        rest: text,
        text,
        depth: 0,
        operators: 0,
        values,
    };
    parser
        .whole()
        .map_err(|reason| format!("\"{}\" cannot be computed: {reason}", text.trim()))
}

/// Whether `a <= b`, or the same with `>=`, `<` or `>`, holds; false where a side is not a number.
///
/// # Errors
/// No comparison; as [`value`].
pub(crate) fn holds(text: &str, values: Values<'_>) -> Result<bool, String> {
    type Compare = fn(&f64, &f64) -> bool;
    let operators: [(&str, Compare); 4] = [
        ("<=", f64::le),
        (">=", f64::ge),
        ("<", f64::lt),
        (">", f64::gt),
    ];
    let found = operators
        .into_iter()
        .find_map(|(operator, compare)| Some((text.split_once(operator)?, compare)));
    let ((left, right), compare) = found.ok_or_else(|| {
        format!("\"{text}\" is not a comparison: two expressions with <=, >=, < or > between")
    })?;
    Ok(compare(&value(left, values)?, &value(right, values)?))
}

/// Length of the number that a text begins with; a sign belongs to it behind an `e`.
fn number_length(text: &str) -> usize {
    let mut is_behind_e = false;
    for (index, c) in text.char_indices() {
        let is_sign = is_behind_e && matches!(c, '+' | '-');
        if !is_sign && !c.is_ascii_digit() && !matches!(c, '.' | 'e' | 'E') {
            return index;
        }
        is_behind_e = matches!(c, 'e' | 'E');
    }
    text.len()
}

/// Two values and the operator between them.
fn combined(a: f64, operator: char, b: f64) -> Result<f64, String> {
    let value = match operator {
        '+' => a + b,
        '-' => a - b,
        '*' => a * b,
        '/' if b == 0.0 => return Err("it divides by zero".into()),
        '/' => a / b,
        _ => a.powf(b),
    };
    if value.is_nan() && !a.is_nan() && !b.is_nan() {
        return Err(format!("{a:?} {operator} {b:?} is not a number"));
    }
    Ok(value)
}

/// Computes while it reads.
struct Parser<'t> {
    rest: &'t str,
    text: &'t str,
    depth: usize,
    operators: usize,
    values: Values<'t>,
}

impl Parser<'_> {
    fn whole(mut self) -> Result<f64, String> {
        let value = self.chain(0)?;
        self.skip();
        if self.rest.is_empty() {
            Ok(value)
        } else {
            Err(self.wrong("an operator, one of + - * / ^"))
        }
    }

    fn skip(&mut self) {
        self.rest = self.rest.trim_start();
    }

    /// Takes one of these characters.
    fn take(&mut self, wanted: &[char]) -> Option<char> {
        self.skip();
        let found = self.rest.chars().next().filter(|c| wanted.contains(c))?;
        self.rest = &self.rest[found.len_utf8()..];
        Some(found)
    }

    fn wrong(&self, wanted: &str) -> String {
        let at = self.text.len() - self.rest.len();
        let place = if self.rest.is_empty() {
            "at its end".to_owned()
        } else {
            format!("at \"{}\"", self.rest)
        };
        format!("{wanted} is needed {place}, character {}", at + 1)
    }

    /// Operands and the operators between them that bind as tightly as `least` at least.
    fn chain(&mut self, least: usize) -> Result<f64, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.wrong("less nesting"));
        }
        let mut left = match self.take(&['+', '-']) {
            Some('-') => -self.chain(SIGN)?,
            Some(_) => self.chain(SIGN)?,
            None => self.primary()?,
        };
        while let Some((binding, operator)) =
            (least..BINDING.len()).find_map(|i| Some((i, self.take(BINDING[i])?)))
        {
            self.operators += 1;
            if self.operators > MOST_OPERATORS {
                return Err(format!("it has more than {MOST_OPERATORS} operators"));
            }
            // Powers are read from the right.
            let right = self.chain(if operator == '^' {
                binding
            } else {
                binding + 1
            })?;
            left = combined(left, operator, right)?;
        }
        self.depth -= 1;
        Ok(left)
    }

    fn primary(&mut self) -> Result<f64, String> {
        if self.take(&['(']).is_some() {
            let inner = self.chain(0)?;
            return self
                .take(&[')'])
                .map(|_| inner)
                .ok_or_else(|| self.wrong("a closing bracket"));
        }
        if self
            .rest
            .starts_with(|c: char| c.is_ascii_digit() || c == '.')
        {
            let (number, rest) = self.rest.split_at(number_length(self.rest));
            let value = number
                .parse()
                .map_err(|_| self.wrong("a number, e.g. 1.5e-6,"))?;
            self.rest = rest;
            return Ok(if self.values.is_some() {
                value
            } else {
                f64::NAN
            });
        }
        let end = self
            .rest
            .find(|c: char| !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.')));
        let (name, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        if name.is_empty() {
            return Err(self.wrong("a number, a key or a bracket"));
        }
        self.rest = rest;
        self.values.map_or(Ok(f64::NAN), |values| values(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(name: &str) -> Result<f64, String> {
        match name {
            "laser.prf_hz" => Ok(400.0),
            "zero" => Ok(0.0),
            _ => Err(format!("{name} is unknown")),
        }
    }

    /// Read before it is computed, as a sweep does.
    fn value(text: &str) -> Result<f64, String> {
        super::value(text, None)?;
        super::value(text, Some(&keys))
    }

    #[test]
    fn values_are_those_of_arithmetic() {
        for (text, expected) in [
            ("0.06/laser.prf_hz", 0.06 / 400.0),
            ("1 + 2*3", 7.0),
            ("(1+2) * 3", 9.0),
            ("2^3^2", 512.0),
            ("-2^2", -4.0),
            ("2^-1", 0.5),
            ("1 - 2 - 3", -4.0),
            ("8/4/2", 1.0),
            ("1.5e-6 - -1E+1", 1.5e-6 + 10.0),
            (".5*zero", 0.0),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn slips_are_refused_with_their_place() {
        for (text, wanted) in [
            ("1/zero", "divides by zero"),
            ("1/(laser.prf_hz - 400)", "divides by zero"),
            ("1 +", "at its end"),
            ("(1", "a closing bracket"),
            ("1 2", "an operator"),
            ("2 $ 3", "at \"$ 3\", character 3"),
            ("1.2.3", "a number, e.g."),
            ("colour*2", "colour is unknown"),
            ("", "at its end"),
            ("(0-1)^0.5", "is not a number"),
        ] {
            let message = value(text).unwrap_err();
            assert!(message.contains(wanted), "{text}: {message}");
        }
        assert!(
            value(&"(".repeat(100_000))
                .unwrap_err()
                .contains("less nesting")
        );
        for operator in ["+", "*"] {
            let long = |terms: usize| value(&vec!["1"; terms].join(operator));
            assert!(long(1001).is_ok());
            assert!(
                long(100_000)
                    .unwrap_err()
                    .contains("more than 1000 operators"),
                "{operator}"
            );
        }
    }

    #[test]
    fn comparisons_hold_or_not() {
        let holds = |text: &str| holds(text, None).and_then(|_| holds(text, Some(&keys)));
        assert_eq!(holds("laser.prf_hz * 2 <= 800"), Ok(true));
        assert_eq!(holds("laser.prf_hz < 400"), Ok(false));
        assert_eq!(holds("laser.prf_hz >= 400"), Ok(true));
        assert_eq!(holds("1 > 2"), Ok(false));
        assert!(
            holds("laser.prf_hz")
                .unwrap_err()
                .contains("not a comparison")
        );
    }
}
