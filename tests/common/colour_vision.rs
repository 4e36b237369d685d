//! Distances of colours under red-green colour blindness.

/// Linear RGB as seen without the cones for red, and without those for green (Machado, Oliveira and
/// Fernandes 2009, severity 1).
const SEEN: [[[f64; 3]; 3]; 3] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [
        [0.152_286, 1.052_583, -0.204_868],
        [0.114_503, 0.786_281, 0.099_216],
        [-0.003_882, -0.048_116, 1.051_998],
    ],
    [
        [0.367_322, 0.860_646, -0.227_968],
        [0.280_085, 0.672_501, 0.047_413],
        [-0.011_820, 0.042_940, 0.968_881],
    ],
];

/// CIE 1976 L*a*b* of a colour (sRGB, 0 to 255, white of D65) as the eye of `seen` perceives it.
fn lab(colour: [u8; 3], seen: &[[f64; 3]; 3]) -> [f64; 3] {
    let linear = colour.map(|c| {
        let c = f64::from(c) / 255.0;
        if c <= 0.040_45 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    });
    let row = |row: &[f64; 3], of: &[f64; 3]| row.iter().zip(of).map(|(a, b)| a * b).sum::<f64>();
    let rgb = [0, 1, 2].map(|i| row(&seen[i], &linear).clamp(0.0, 1.0));
    let xyz = [
        row(&[0.4124, 0.3576, 0.1805], &rgb) / 0.950_47,
        row(&[0.2126, 0.7152, 0.0722], &rgb),
        row(&[0.0193, 0.1192, 0.9505], &rgb) / 1.088_83,
    ];
    let [x, y, z] = xyz.map(|t| {
        if t > 0.008_856 {
            t.cbrt()
        } else {
            7.787 * t + 16.0 / 116.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The least difference (CIE 1976) between two of the colours, with all cones, without those for
/// red, without those for green.
pub fn least_difference(colours: &[[u8; 3]]) -> f64 {
    let mut least = f64::INFINITY;
    for seen in &SEEN {
        let labs: Vec<[f64; 3]> = colours.iter().map(|colour| lab(*colour, seen)).collect();
        for (at, a) in labs.iter().enumerate() {
            for b in &labs[at + 1..] {
                least = least.min((0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt());
            }
        }
    }
    least
}
