// SPDX-License-Identifier: GPL-3.0-or-later
// What the printed formulas call. GLSL promises few digits of exp, log, pow, sin, cos and atan, or none: these compute
// them to about 1e-6 with additions, multiplications and divisions alone, so that every device shows the same.

float brdfc_select(bool c, float a, float b) { return c ? a : b; }
vec3 brdfc_select(bool c, vec3 a, vec3 b) { return c ? a : b; }
bool brdfc_select(bool c, bool a, bool b) { return c ? a : b; }

// e^x = 2^k e^r with |r| <= log(2) / 2; log(2) is split, so that k times its first part is exact.
float brdfc_exp(float x)
{
    float bounded = clamp(x, -120.0, 89.0);
    float k = floor(bounded * 1.44269504 + 0.5);
    float r = (bounded - k * 0.693359375) + k * 2.12194440e-4;
    float sum = 1.0 + r * (1.0 + r * (0.5 + r * (1.66666667e-1 + r * (4.16666667e-2 + r * (8.33333333e-3 + r * 1.38888889e-3)))));
    int first = int(k) / 2, second = int(k) - first;
    return sum * intBitsToFloat((first + 127) << 23) * intBitsToFloat((second + 127) << 23);
}
vec3 brdfc_exp(vec3 x) { return vec3(brdfc_exp(x.r), brdfc_exp(x.g), brdfc_exp(x.b)); }

// 2 artanh(z), z = x / (2 + x), for |x| < 0.42.
float brdfc_log_near_1(float x)
{
    float z = x / (2.0 + x);
    float z2 = z * z;
    return 2.0 * z * (1.0 + z2 * (1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0 + z2 / 11.0)))));
}

// x = m 2^k with m from sqrt(1/2) to sqrt(2). x = 0 gives a very negative number, as infinity may be undefined.
float brdfc_log(float x)
{
    int bits = floatBitsToInt(x) - 0x3f3504f3;
    float k = float(bits >> 23);
    float m = intBitsToFloat((bits & 0x7fffff) + 0x3f3504f3);
    float normal = k * 0.693359375 + (brdfc_log_near_1(m - 1.0) - k * 2.12194440e-4);
    return x < 1.17549435e-38 ? -1e30 : normal;
}
vec3 brdfc_log(vec3 x) { return vec3(brdfc_log(x.r), brdfc_log(x.g), brdfc_log(x.b)); }

float brdfc_expm1(float x)
{
    float near = x * (1.0 + x * (1.0 / 2.0 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x * (1.0 / 720.0
        + x / 5040.0))))));
    float far = brdfc_exp(x) - 1.0;
    return abs(x) < 0.4 ? near : far;
}

float brdfc_log1p(float x)
{
    float near = brdfc_log_near_1(x), far = brdfc_log(1.0 + x);
    return abs(x) < 0.4 ? near : far;
}

// As C's pow for a base from 0; for negative ones only with whole exponents.
float brdfc_pow(float x, float y)
{
    float size = brdfc_exp(y * brdfc_log(abs(x)));
    float odd = x < 0.0 && fract(y * 0.5) != 0.0 ? -1.0 : 1.0;
    return y == 0.0 ? 1.0 : odd * size;
}

float brdfc_cbrt(float x)
{
    float r = brdfc_exp(brdfc_log(abs(x)) / 3.0);
    r -= (r - abs(x) / max(r * r, 1e-30)) / 3.0;
    return x == 0.0 ? 0.0 : sign(x) * r;
}

// sin and cos of x = k pi/2 + r with |r| <= pi/4, as (cos, sin); pi/2 is split into three.
vec2 brdfc_turn(float x)
{
    float k = floor(x * 0.636619772 + 0.5);
    float r = ((x - k * 1.5703125) - k * 4.83751297e-4) - k * 7.54978995e-8;
    float r2 = r * r;
    float s = r * (1.0 + r2 * (-1.66666667e-1 + r2 * (8.33333310e-3 + r2 * (-1.98408743e-4 + r2 * 2.75255615e-6))));
    float c = 1.0 + r2 * (-0.5 + r2 * (4.16666642e-2 + r2 * (-1.38887475e-3 + r2 * 2.47632466e-5)));
    int quarter = int(k) & 3;
    vec2 turned = (quarter & 1) == 0 ? vec2(c, s) : vec2(-s, c);
    return turned * (quarter < 2 ? 1.0 : -1.0);
}
float brdfc_sin(float x) { return brdfc_turn(x).y; }
float brdfc_cos(float x) { return brdfc_turn(x).x; }

// For |x| <= tan(pi/8) a series; larger ones are turned by pi/4 or pi/2.
float brdfc_atan(float x)
{
    float a = abs(x);
    bool wide = a > 2.41421356, middle = a > 0.414213562;
    float from = wide ? 1.57079633 : middle ? 0.785398163 : 0.0;
    float above = wide ? -1.0 : middle ? a - 1.0 : a, below = wide ? a : middle ? a + 1.0 : 1.0;
    float t = above / below, z = t * t;
    return sign(x) * (from + (t + t * z * (-3.33329491539e-1 + z * (1.99777106478e-1 + z * (-1.38776856032e-1
        + z * 8.05374449538e-2)))));
}

float brdfc_max_component(vec3 c) { return max(c.r, max(c.g, c.b)); }

// Tables are textures of this many columns, row by row.
float brdfc_entry(sampler2D t, int i) { return texelFetch(t, ivec2(i & 255, i >> 8), 0).r; }

// Multilinear look-ups on even grids over [0, 1], with n knots an axis; the last axis varies fastest.
float brdfc_row(sampler2D t, int at, int n, float x)
{
    float position = clamp(x, 0.0, 1.0) * float(n - 1);
    int i = min(int(position), n - 2);
    return mix(brdfc_entry(t, at + i), brdfc_entry(t, at + i + 1), position - float(i));
}
float brdfc_table1(sampler2D t, int n0, float x0) { return brdfc_row(t, 0, n0, x0); }
float brdfc_plane(sampler2D t, int at, int n0, int n1, float x0, float x1)
{
    float position = clamp(x0, 0.0, 1.0) * float(n0 - 1);
    int i = min(int(position), n0 - 2);
    float low = brdfc_row(t, (at + i) * n1, n1, x1), high = brdfc_row(t, (at + i + 1) * n1, n1, x1);
    return mix(low, high, position - float(i));
}
float brdfc_table2(sampler2D t, int n0, int n1, float x0, float x1) { return brdfc_plane(t, 0, n0, n1, x0, x1); }
float brdfc_block(sampler2D t, int at, int n0, int n1, int n2, float x0, float x1, float x2)
{
    float position = clamp(x0, 0.0, 1.0) * float(n0 - 1);
    int i = min(int(position), n0 - 2);
    float low = brdfc_plane(t, (at + i) * n1, n1, n2, x1, x2), high = brdfc_plane(t, (at + i + 1) * n1, n1, n2, x1, x2);
    return mix(low, high, position - float(i));
}
float brdfc_table3(sampler2D t, int n0, int n1, int n2, float x0, float x1, float x2)
{
    return brdfc_block(t, 0, n0, n1, n2, x0, x1, x2);
}
float brdfc_table4(sampler2D t, int n0, int n1, int n2, int n3, float x0, float x1, float x2, float x3)
{
    float position = clamp(x0, 0.0, 1.0) * float(n0 - 1);
    int i = min(int(position), n0 - 2);
    float low = brdfc_block(t, i * n1, n1, n2, n3, x1, x2, x3);
    float high = brdfc_block(t, (i + 1) * n1, n1, n2, n3, x1, x2, x3);
    return mix(low, high, position - float(i));
}
