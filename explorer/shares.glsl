// SPDX-License-Identifier: GPL-3.0-or-later
// Shares of the light from a direction, by column: ideal reflection, ideal refraction, and the indices of refraction.

uniform vec3 from;
out vec4 color;

void main()
{
    int column = int(gl_FragCoord.x);
    color = vec4(column == 0 ? mirror_0(from) : column == 1 ? transmit_0(from) : iors_0(), 1.0);
}
