// Vectors as arrays of three numbers.

export const plus = (a, b, factor = 1) => a.map((value, axis) => value + factor * b[axis]);
export const length = (a) => Math.hypot(...a);
export const apart = (a, b) => length(plus(a, b, -1));
