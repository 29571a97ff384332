// Squares, boxes and balls of a list, each as triangles of their sides that the eye sees. Needs
// lens.glsl and list.glsl.
uniform vec4 viewport;             // as light.vert has it
uniform int thing_kind;            // SpriteShape::Kind
uniform int thing_vertices;        // of each
uniform vec3 thing_half;           // half sizes
uniform vec3 thing_right, thing_up;  // a square's axes
uniform vec4 thing_eye;            // less list_origin; w 0: a direction
uniform vec2 thing_reach;          // of its corners from its center, as isSeen wants it
uniform float thing_nearest;       // nearer ones are drawn otherwise

out vec4 vertex_color;

// -1 or 1, twice: corners of a square, two triangles.
vec2 squareCorner(int k) {
  int corner = k < 3 ? k : (k == 3 ? 0 : k - 2);
  return vec2(corner == 1 || corner == 2 ? 1.0 : -1.0, corner >= 2 ? 1.0 : -1.0);
}

// Of each axis the side toward the eye, if that is not between both.
vec3 boxCorner(vec3 to_eye, int k) {
  int axis = k / 6;
  float limit = thing_eye.w == 0.0 ? 0.0 : thing_half[axis];
  vec2 at = squareCorner(k % 6);
  vec3 corner;
  corner[axis] = sign(to_eye[axis]);
  corner[(axis + 1) % 3] = at.x;
  corner[(axis + 2) % 3] = at.y;
  return abs(to_eye[axis]) > limit ? corner * thing_half : vec3(0.0);
}

// The circle where lines of sight touch the ball, as a fan of its area; an ellipsoid is a ball in
// its own scale.
vec3 ballCorner(vec3 to_eye, int k) {
  float angle = 6.28318531 / float(thing_vertices / 3 + 2);
  float at = angle * float(k % 3 == 0 ? 0 : k / 3 + k % 3);
  vec3 eye = to_eye / thing_half;
  float middle = thing_eye.w / length(eye);
  vec3 n = normalize(eye);
  vec3 x = normalize(cross(n, abs(n.x) < 0.7 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
  float radius = sqrt(max(1.0 - middle * middle, 0.0) * angle / sin(angle));
  return (n * middle + radius * (cos(at) * x + sin(at) * cross(n, x))) * thing_half;
}

void main() {
  uint i = uint(gl_VertexID / thing_vertices);
  int k = gl_VertexID % thing_vertices;
  vec3 p = listPoint(i), to_eye = thing_eye.xyz - thing_eye.w * p;
  vec2 at = squareCorner(k) * thing_half.xy;
  vec3 corner = p + (thing_kind == 0   ? at.x * thing_right + at.y * thing_up
                     : thing_kind == 1 ? boxCorner(to_eye, k)
                                       : ballCorner(to_eye, k));
  vec4 center = P_optical_list * vec4(p, 1.0), q = P_optical_list * vec4(corner, 1.0);
  vertex_color = listColor(i);
  bool is_seen = isSeen(center, thing_reach.x, thing_reach.y) && center.z >= thing_nearest &&
                 vertex_color.a > 0.0;
  vec2 window = windowFromPixel(lensPixel(q.xyz));
  vec2 ndc = 2.0 * (window - viewport.xy) / viewport.zw - 1.0;
  gl_Position = is_seen ? vec4(ndc, listDepth(corner, q), 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}
