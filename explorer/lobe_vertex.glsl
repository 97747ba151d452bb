// SPDX-License-Identifier: GPL-3.0-or-later
// A lobe's mesh as a far viewer sees it; `right`, `up` and `towards` the viewer are unit vectors.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tint;
uniform vec3 right;
uniform vec3 up;
uniform vec3 towards;
uniform float middle;
out vec3 facing;
out vec4 own;

void main()
{
    mat3 view = mat3(right, up, towards);
    vec3 p = (position - vec3(0.0, 0.0, middle)) * view;
    facing = normal * view;
    own = tint;
    gl_Position = vec4(p.xy / 1.25, -p.z / 3.0, 1.0);
}
