// An adapter in C++17: one file, no dependencies: copy it and put your own functions into the table at the end.
//
//     g++ -std=c++17 -O2 -o adapter adapter.cpp
//     vslam-ref verify --program ./adapter
//
// It reads one request a line from standard input and writes one reply a line to standard output:
//
//     {"id": "so3.exp/generic-01", "function": "so3.exp", "inputs": {"phi": [0.1, 0.2, 0.3]}}
//     {"id": "so3.exp/generic-01", "value": {"R": [[...], [...], [...]]}}
//
// or {"id": ..., "unsupported": true}, or {"id": ..., "error": "why"}.  Nothing else may go to standard
// output.
// Compile without -ffast-math: it breaks what is not finite.
//
//   1 JSON   2 matrices   3 between the two   4 groups   5 cameras   6 losses and steps   7 filters
//   8 grids, trajectories, files   9 the table   10 the answers.  Yours are 4 to 9; keep 1, 2, 3 and 10.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// ------------------------------------------------------------------ 1 JSON

struct Json {
  enum Kind { Null, Bool, Number, String, Array, Object };
  Kind kind = Null;
  double number = 0.0;  // a truth value is 0 or 1
  std::string text;
  std::vector<Json> items;
  std::vector<std::pair<std::string, Json>> fields;

  Json() = default;
  Json(double x) : kind(Number), number(x) {}
  Json(const std::string& s) : kind(String), text(s) {}
  static Json truth(bool x) {
    Json j(x ? 1.0 : 0.0);
    j.kind = Bool;
    return j;
  }
  static Json array() {
    Json j;
    j.kind = Array;
    return j;
  }
  static Json object(std::vector<std::pair<std::string, Json>> f) {
    Json j;
    j.kind = Object;
    j.fields = std::move(f);
    return j;
  }
  const Json& operator[](const std::string& name) const {
    for (const auto& field : fields)
      if (field.first == name) return field.second;
    throw std::runtime_error("no field " + name);
  }
};

class Reader {
 public:
  explicit Reader(const std::string& text) : s(text) {}
  Json all() {
    Json j = value();
    space();
    if (at != s.size()) fail("text after the end");
    return j;
  }

 private:
  const std::string& s;
  size_t at = 0;

  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error("JSON, column " + std::to_string(at + 1) + ": " + why);
  }
  void space() {
    while (at < s.size() && (s[at] == ' ' || s[at] == '\t' || s[at] == '\r' || s[at] == '\n')) ++at;
  }
  bool eat(char c) {
    space();
    if (at >= s.size() || s[at] != c) return false;
    ++at;
    return true;
  }
  bool word(const char* w) {
    const std::string x(w);
    if (s.compare(at, x.size(), x) != 0) return false;
    at += x.size();
    return true;
  }
  Json value() {
    space();
    if (at >= s.size()) fail("it ends too early");
    if (eat('{')) return object();
    if (eat('[')) return list();
    if (s[at] == '"') return Json(string());
    if (word("true")) return Json::truth(true);
    if (word("false")) return Json::truth(false);
    if (word("null")) return Json();
    char* end = nullptr;
    const double x = std::strtod(s.c_str() + at, &end);
    if (end == s.c_str() + at) fail("expected a value");
    at = static_cast<size_t>(end - s.c_str());
    return Json(x);
  }
  Json object() {
    Json j = Json::object({});
    if (eat('}')) return j;
    do {
      space();
      std::string name = string();
      if (!eat(':')) fail("expected a colon");
      j.fields.emplace_back(std::move(name), value());
    } while (eat(','));
    if (!eat('}')) fail("expected , or }");
    return j;
  }
  Json list() {
    Json j = Json::array();
    if (eat(']')) return j;
    do j.items.push_back(value());
    while (eat(','));
    if (!eat(']')) fail("expected , or ]");
    return j;
  }
  std::string string() {
    if (at >= s.size() || s[at] != '"') fail("expected a string");
    std::string out;
    for (++at; at < s.size() && s[at] != '"'; ++at) {
      if (s[at] != '\\') {
        out += s[at];
        continue;
      }
      if (++at >= s.size()) break;
      switch (s[at]) {
        case 'n': out += '\n'; break;
        case 't': out += '\t'; break;
        case 'r': out += '\r'; break;
        case 'b': out += '\b'; break;
        case 'f': out += '\f'; break;
        case 'u': unicode(out); break;
        default: out += s[at];
      }
    }
    if (at >= s.size()) fail("a string without end");
    ++at;
    return out;
  }
  void unicode(std::string& out) {  // the basic plane, as UTF-8
    if (at + 4 >= s.size()) fail("a string without end");
    const unsigned c = static_cast<unsigned>(std::strtoul(s.substr(at + 1, 4).c_str(), nullptr, 16));
    at += 4;
    if (c < 0x80) {
      out += static_cast<char>(c);
    } else if (c < 0x800) {
      out += static_cast<char>(0xC0 | (c >> 6));
      out += static_cast<char>(0x80 | (c & 63));
    } else {
      out += static_cast<char>(0xE0 | (c >> 12));
      out += static_cast<char>(0x80 | ((c >> 6) & 63));
      out += static_cast<char>(0x80 | (c & 63));
    }
  }
};

void write(std::string& out, const std::string& text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", c);
      out += code;
    } else {
      out += c;
    }
  }
  out += '"';
}

void write(std::string& out, const Json& j) {
  if (j.kind == Json::Null) out += "null";
  if (j.kind == Json::Bool) out += j.number != 0.0 ? "true" : "false";
  if (j.kind == Json::String) write(out, j.text);
  if (j.kind == Json::Number) {
    if (std::isnan(j.number)) out += "\"nan\"";  // JSON has no word for these; the runner takes strings
    else if (std::isinf(j.number)) out += j.number > 0 ? "\"inf\"" : "\"-inf\"";
    else {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.17g", j.number);  // 17 digits read back to the same double
      out += digits;
    }
  }
  if (j.kind == Json::Array) {
    out += '[';
    for (size_t k = 0; k < j.items.size(); ++k) {
      if (k) out += ", ";
      write(out, j.items[k]);
    }
    out += ']';
  }
  if (j.kind == Json::Object) {
    out += '{';
    for (size_t k = 0; k < j.fields.size(); ++k) {
      if (k) out += ", ";
      write(out, j.fields[k].first);
      out += ": ";
      write(out, j.fields[k].second);
    }
    out += '}';
  }
}

// -------------------------------------------------------------- 2 matrices

struct Vec : std::vector<double> {  // a wrong index is an error that is told, not a crash
  using std::vector<double>::vector;
  double& operator[](size_t k) { return at(k); }
  double operator[](size_t k) const { return at(k); }
};

struct Mat {  // rows x cols, row by row
  int rows = 0, cols = 0;
  Vec a;
  Mat() = default;
  Mat(int r, int c) : rows(r), cols(c), a(static_cast<size_t>(r) * static_cast<size_t>(c), 0.0) {}
  double& operator()(int i, int j) { return a[index(i, j)]; }
  double operator()(int i, int j) const { return a[index(i, j)]; }
  size_t index(int i, int j) const {
    if (i < 0 || j < 0 || i >= rows || j >= cols) throw std::runtime_error("matrix of another size");
    return static_cast<size_t>(i * cols + j);
  }
};

Mat eye(int n) {
  Mat M(n, n);
  for (int i = 0; i < n; ++i) M(i, i) = 1.0;
  return M;
}
Mat operator*(const Mat& A, const Mat& B) {
  if (A.cols != B.rows) throw std::runtime_error("matrices that do not fit");
  Mat C(A.rows, B.cols);
  for (int i = 0; i < A.rows; ++i)
    for (int k = 0; k < A.cols; ++k)
      for (int j = 0; j < B.cols; ++j) C(i, j) += A(i, k) * B(k, j);
  return C;
}
Mat operator*(double s, Mat A) {
  for (double& x : A.a) x *= s;
  return A;
}
Mat operator+(Mat A, const Mat& B) {
  for (size_t k = 0; k < A.a.size(); ++k) A.a[k] += B.a[k];
  return A;
}
Mat operator-(const Mat& A, const Mat& B) { return A + -1.0 * B; }
Vec operator*(const Mat& A, const Vec& x) {
  if (A.cols != static_cast<int>(x.size())) throw std::runtime_error("matrix and vector that do not fit");
  Vec y(static_cast<size_t>(A.rows), 0.0);
  for (int i = 0; i < A.rows; ++i)
    for (int j = 0; j < A.cols; ++j) y[i] += A(i, j) * x[j];
  return y;
}
Vec operator+(Vec a, const Vec& b) {
  for (size_t k = 0; k < a.size(); ++k) a[k] += b[k];
  return a;
}
Vec operator*(double s, Vec a) {
  for (double& x : a) x *= s;
  return a;
}
Vec operator-(const Vec& a, const Vec& b) { return a + -1.0 * b; }
double dot(const Vec& a, const Vec& b) {
  double sum = 0.0;
  for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}
double norm(const Vec& a) { return std::sqrt(dot(a, a)); }
Mat transpose(const Mat& A) {
  Mat B(A.cols, A.rows);
  for (int i = 0; i < A.rows; ++i)
    for (int j = 0; j < A.cols; ++j) B(j, i) = A(i, j);
  return B;
}
Mat block(const Mat& A, int i0, int j0, int r, int c) {
  Mat B(r, c);
  for (int i = 0; i < r; ++i)
    for (int j = 0; j < c; ++j) B(i, j) = A(i0 + i, j0 + j);
  return B;
}
void put(Mat& A, int i0, int j0, const Mat& B) {
  for (int i = 0; i < B.rows; ++i)
    for (int j = 0; j < B.cols; ++j) A(i0 + i, j0 + j) = B(i, j);
}
Vec part(const Vec& v, int from, int count) {
  if (from + count > static_cast<int>(v.size())) throw std::runtime_error("too few numbers");
  return Vec(v.begin() + from, v.begin() + from + count);
}
Mat column(const Vec& v) {
  Mat M(static_cast<int>(v.size()), 1);
  M.a = v;
  return M;
}
double largest(const Mat& A) {
  double m = 0.0;
  for (const double x : A.a) m = std::max(m, std::abs(x));
  return m;
}

Mat solve(Mat A, Mat B) {  // A X = B by elimination with row exchanges
  const int n = A.rows;
  for (int k = 0; k < n; ++k) {
    int p = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(A(i, k)) > std::abs(A(p, k))) p = i;
    if (!(std::abs(A(p, k)) > 0.0)) throw std::runtime_error("singular matrix");
    for (int j = 0; j < n; ++j) std::swap(A(k, j), A(p, j));
    for (int j = 0; j < B.cols; ++j) std::swap(B(k, j), B(p, j));
    for (int i = k + 1; i < n; ++i) {
      const double f = A(i, k) / A(k, k);
      for (int j = k; j < n; ++j) A(i, j) -= f * A(k, j);
      for (int j = 0; j < B.cols; ++j) B(i, j) -= f * B(k, j);
    }
  }
  for (int k = n - 1; k >= 0; --k)
    for (int j = 0; j < B.cols; ++j) {
      for (int i = k + 1; i < n; ++i) B(k, j) -= A(k, i) * B(i, j);
      B(k, j) /= A(k, k);
    }
  return B;
}
Vec solve(const Mat& A, const Vec& b) { return solve(A, column(b)).a; }
Mat inverse(const Mat& A) { return solve(A, eye(A.rows)); }

Mat cholesky(const Mat& A) {  // lower factor; refuses what is not positive definite
  Mat L(A.rows, A.rows);
  for (int i = 0; i < A.rows; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      if (i == j && !(sum > 0.0)) throw std::runtime_error("matrix is not positive definite");
      L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
    }
  return L;
}

Vec least_squares(Mat A, Vec b) {  // Householder reflections; refuses a rank that is not full
  const int m = A.rows, n = A.cols;
  const double scale = largest(A);
  if (m < n) throw std::runtime_error("fewer equations than unknowns");
  for (int k = 0; k < n; ++k) {
    double alpha = 0.0;
    for (int i = k; i < m; ++i) alpha += A(i, k) * A(i, k);
    alpha = A(k, k) > 0 ? -std::sqrt(alpha) : std::sqrt(alpha);
    if (std::abs(alpha) <= 1e-13 * m * scale) throw std::runtime_error("the columns are dependent");
    Vec v(static_cast<size_t>(m), 0.0);
    for (int i = k; i < m; ++i) v[i] = A(i, k);
    v[k] -= alpha;
    const double vv = dot(v, v);
    for (int j = k; j < n; ++j) {
      double s = 0.0;
      for (int i = k; i < m; ++i) s += v[i] * A(i, j);
      for (int i = k; i < m; ++i) A(i, j) -= 2.0 * s / vv * v[i];
    }
    b = b - (2.0 * dot(v, b) / vv) * v;
  }
  Vec x(static_cast<size_t>(n));
  for (int k = n - 1; k >= 0; --k) {
    x[k] = b[k];
    for (int j = k + 1; j < n; ++j) x[k] -= A(k, j) * x[j];
    x[k] /= A(k, k);
  }
  return x;
}

// ------------------------------------------------- 3 between the two of them

// From JSON: v a vector, m a matrix, x a number, s a word.  To JSON: to().
double x(const Json& j) {
  if (j.kind == Json::Number || j.kind == Json::Bool) return j.number;
  if (j.kind == Json::String && j.text == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (j.kind == Json::String && j.text == "inf") return std::numeric_limits<double>::infinity();
  if (j.kind == Json::String && j.text == "-inf") return -std::numeric_limits<double>::infinity();
  throw std::runtime_error("expected a number");
}
Vec v(const Json& j) {
  if (j.kind != Json::Array) throw std::runtime_error("expected a list");
  Vec out;
  for (const Json& item : j.items) out.push_back(x(item));
  return out;
}
Mat m(const Json& j) {
  Mat M(static_cast<int>(j.items.size()), j.items.empty() ? 0 : static_cast<int>(j.items[0].items.size()));
  for (int i = 0; i < M.rows; ++i) {
    const Vec row = v(j.items[static_cast<size_t>(i)]);
    if (static_cast<int>(row.size()) != M.cols) throw std::runtime_error("rows of different lengths");
    for (int k = 0; k < M.cols; ++k) M(i, k) = row[static_cast<size_t>(k)];
  }
  return M;
}
std::string s(const Json& j) { return j.text; }

Json to(double value) { return Json(value); }
Json to(const Json& j) { return j; }
Json to(const Vec& values) {
  Json j = Json::array();
  for (const double value : values) j.items.push_back(Json(value));
  return j;
}
Json to(const Mat& M) {
  Json j = Json::array();
  for (int i = 0; i < M.rows; ++i) j.items.push_back(to(block(M, i, 0, 1, M.cols).a));
  return j;
}

#define ANSWER(expression) [](const Json& in) -> Json { return to(expression); }

// ---------------------------------------------------------------- 4 groups

const double PI = 3.14159265358979323846;

double wrap(double angle) {  // (-pi, pi]
  const double x = std::remainder(angle, 2.0 * PI);
  return x <= -PI ? PI : x;
}

// phi1(M) = sum M^k / (k + 1)!, so Exp = I + M phi1(M), and phi1(ad xi) is the left Jacobian of any group.
// M is halved until it is small, then phi1(2 M) = phi1(M) (Exp(M) + I) / 2.
Mat phi1(Mat M) {
  int halvings = 0;
  for (; largest(M) * M.rows > 1.0; ++halvings) M = 0.5 * M;
  const Mat I = eye(M.rows);
  Mat sum = I;
  for (int k = 18; k >= 1; --k) sum = I + (1.0 / (k + 1)) * (M * sum);
  for (; halvings > 0; --halvings) {
    sum = 0.5 * (sum * (I + (I + M * sum)));
    M = 2.0 * M;
  }
  return sum;
}

Mat hat(const Vec& w) {
  Mat W(3, 3);
  W(0, 1) = -w[2], W(0, 2) = w[1], W(1, 2) = -w[0];
  W(1, 0) = w[2], W(2, 0) = -w[1], W(2, 1) = w[0];
  return W;
}

Mat so3_exp(const Vec& phi) {
  const double a = norm(phi);
  const double sinc = a < 1e-4 ? 1.0 - a * a / 6.0 : std::sin(a) / a;
  const double h = 0.5 * a, half = a < 1e-4 ? 1.0 - h * h / 6.0 : std::sin(h) / h;
  const Mat W = hat(phi);
  return eye(3) + sinc * W + (0.5 * half * half) * (W * W);
}

Vec quaternion(const Mat& R) {  // w x y z: the largest component first, so nothing cancels
  const double t[4] = {R(0, 0) + R(1, 1) + R(2, 2), R(0, 0) - R(1, 1) - R(2, 2), R(1, 1) - R(0, 0) - R(2, 2),
                       R(2, 2) - R(0, 0) - R(1, 1)};
  const int k = static_cast<int>(std::max_element(t, t + 4) - t);
  const double wx = R(2, 1) - R(1, 2), wy = R(0, 2) - R(2, 0), wz = R(1, 0) - R(0, 1);
  const double xy = R(0, 1) + R(1, 0), xz = R(0, 2) + R(2, 0), yz = R(1, 2) + R(2, 1), big = 1.0 + t[k];
  Vec q = k == 0   ? Vec{big, wx, wy, wz}
          : k == 1 ? Vec{wx, big, xy, xz}
          : k == 2 ? Vec{wy, xy, big, yz}
                   : Vec{wz, xz, yz, big};
  return (1.0 / norm(q)) * q;
}

Mat rotation(const Vec& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  Mat R(3, 3);
  R.a = {w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
         2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
         2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z};
  return R;
}

Vec so3_log(const Mat& R) {
  Vec q = quaternion(R);
  if (q[0] < 0) q = -1.0 * q;
  const Vec v = part(q, 1, 3);
  const double s = norm(v);
  return (s < 1e-9 ? 2.0 / q[0] : 2.0 * std::atan2(s, q[0]) / s) * v;
}

Mat so3_left_inverse(const Vec& phi) {  // I - W/2 + (1 - a/2 cot(a/2)) / a^2 W^2
  const double a = norm(phi), h = 0.5 * a;
  const double d = a < 1e-2 ? 1.0 / 12.0 + a * a / 720.0 + a * a * a * a / 30240.0
                            : (1.0 - h * std::cos(h) / std::sin(h)) / (a * a);
  const Mat W = hat(phi);
  return eye(3) - 0.5 * W + d * (W * W);
}

Mat so3_between(const Mat& a, const Mat& b, double fraction) {
  return a * so3_exp(fraction * so3_log(transpose(a) * b));
}

Mat so3_nearest(const Mat& M) {  // Newton's iteration X <- (X + X^-T)/2 for the polar factor
  Mat X = M;
  for (int k = 0; k < 60; ++k) {
    const Mat Y = 0.5 * (X + transpose(inverse(X)));
    const double moved = largest(Y - X);
    X = Y;
    if (moved < 1e-15) break;
  }
  const double det = X(0, 0) * (X(1, 1) * X(2, 2) - X(1, 2) * X(2, 1)) - X(0, 1) * (X(1, 0) * X(2, 2) - X(1, 2) * X(2, 0)) +
                     X(0, 2) * (X(1, 0) * X(2, 1) - X(1, 1) * X(2, 0));
  if (det > 0) return X;
  // a mirror: turn it about in the direction that M stretches least, found by inverse iteration on X^T M
  const Mat back = inverse(transpose(X) * M);
  Vec v = {0.6, -0.5, 0.62};
  for (int k = 0; k < 400; ++k) {
    v = back * v;
    v = (1 / norm(v)) * v;
  }
  return X * (eye(3) - 2.0 * (column(v) * transpose(column(v))));
}

Mat rigid(const Mat& A, const Vec& t) {
  Mat T = eye(A.rows + 1);
  put(T, 0, 0, A);
  put(T, 0, A.rows, column(t));
  return T;
}
Mat turn(const Mat& T) { return block(T, 0, 0, T.rows - 1, T.rows - 1); }
Vec shift(const Mat& T) { return block(T, 0, T.rows - 1, T.rows - 1, 1).a; }
Mat inverse_of_similarity(const Mat& S) {  // also of a rigid motion
  const Mat A = inverse(turn(S));
  return rigid(A, -1.0 * (A * shift(S)));
}
Mat inverse_of_motion(const Mat& T) {
  const Mat Rt = transpose(turn(T));
  return rigid(Rt, -1.0 * (Rt * shift(T)));
}

Mat se3_exp(const Vec& xi) {  // translation first
  const Vec phi = part(xi, 3, 3);
  return rigid(so3_exp(phi), phi1(hat(phi)) * part(xi, 0, 3));
}
Vec se3_log(const Mat& T) {
  const Vec phi = so3_log(turn(T));
  Vec xi = so3_left_inverse(phi) * shift(T);
  xi.insert(xi.end(), phi.begin(), phi.end());
  return xi;
}
Mat se3_adjoint(const Mat& T) {
  Mat A(6, 6);
  put(A, 0, 0, turn(T));
  put(A, 3, 3, turn(T));
  put(A, 0, 3, hat(shift(T)) * turn(T));
  return A;
}
Mat se3_ad(const Vec& xi) {
  Mat A(6, 6);
  put(A, 0, 0, hat(part(xi, 3, 3)));
  put(A, 3, 3, hat(part(xi, 3, 3)));
  put(A, 0, 3, hat(part(xi, 0, 3)));
  return A;
}
Mat se3_between(const Mat& a, const Mat& b, double fraction) {
  return a * se3_exp(fraction * se3_log(inverse_of_motion(a) * b));
}

Mat sim3_v(const Vec& xi) { return phi1(hat(part(xi, 3, 3)) + xi[6] * eye(3)); }
Mat sim3_exp(const Vec& xi) {
  return rigid(std::exp(xi[6]) * so3_exp(part(xi, 3, 3)), sim3_v(xi) * part(xi, 0, 3));
}
double sim3_scale(const Mat& S) { return norm(block(S, 0, 0, 3, 1).a); }
Vec sim3_log(const Mat& S) {
  const double s = sim3_scale(S);
  const Vec phi = so3_log((1.0 / s) * turn(S));
  const Vec xi{0, 0, 0, phi[0], phi[1], phi[2], std::log(s)};
  const Vec rho = solve(sim3_v(xi), shift(S));
  return {rho[0], rho[1], rho[2], phi[0], phi[1], phi[2], xi[6]};
}
Mat sim3_adjoint(const Mat& S) {
  const double s = sim3_scale(S);
  const Mat R = (1.0 / s) * turn(S);
  Mat A(7, 7);
  put(A, 0, 0, s * R);
  put(A, 0, 3, hat(shift(S)) * R);
  put(A, 0, 6, column(-1.0 * shift(S)));
  put(A, 3, 3, R);
  A(6, 6) = 1.0;
  return A;
}

Mat so2_exp(double a) {
  Mat R(2, 2);
  R.a = {std::cos(a), -std::sin(a), std::sin(a), std::cos(a)};
  return R;
}
Mat plane_v(double a) {
  Mat W(2, 2);
  W(0, 1) = -a, W(1, 0) = a;
  return phi1(W);
}
Vec se2_exp(const Vec& xi) {
  const Vec t = plane_v(xi[2]) * part(xi, 0, 2);
  return {t[0], t[1], wrap(xi[2])};
}
Vec se2_log(const Vec& x) {
  const double a = wrap(x[2]);
  const Vec rho = solve(plane_v(a), part(x, 0, 2));
  return {rho[0], rho[1], a};
}
Vec se2_compose(const Vec& a, const Vec& b) {
  const Vec t = so2_exp(a[2]) * part(b, 0, 2);
  return {a[0] + t[0], a[1] + t[1], wrap(a[2] + b[2])};
}
Vec se2_inverse(const Vec& x) {
  const Vec t = transpose(so2_exp(x[2])) * part(x, 0, 2);
  return {-t[0], -t[1], wrap(-x[2])};
}
Mat se2_adjoint(const Vec& x) {
  Mat A = eye(3);
  put(A, 0, 0, so2_exp(x[2]));
  A(0, 2) = x[1], A(1, 2) = -x[0];
  return A;
}
Mat se2_ad(const Vec& xi) {
  Mat A(3, 3);
  A(0, 1) = -xi[2], A(1, 0) = xi[2], A(0, 2) = xi[1], A(1, 2) = -xi[0];
  return A;
}

// --------------------------------------------------------------- 5 cameras

// A number with its derivatives: every Jacobian of the cameras comes from the one function project().
struct Dual {
  double v = 0.0;
  std::array<double, 12> d{};
  Dual() = default;
  Dual(double x) : v(x) {}
  Dual(double x, int k) : v(x) { d[static_cast<size_t>(k)] = 1.0; }
};
Dual chain(const Dual& a, double value, double slope) {
  Dual y(value);
  for (size_t k = 0; k < y.d.size(); ++k) y.d[k] = slope * a.d[k];
  return y;
}
Dual operator+(const Dual& a, const Dual& b) {
  Dual y(a.v + b.v);
  for (size_t k = 0; k < y.d.size(); ++k) y.d[k] = a.d[k] + b.d[k];
  return y;
}
Dual operator*(const Dual& a, const Dual& b) {
  Dual y(a.v * b.v);
  for (size_t k = 0; k < y.d.size(); ++k) y.d[k] = a.d[k] * b.v + a.v * b.d[k];
  return y;
}
Dual operator/(const Dual& a, const Dual& b) { return a * chain(b, 1.0 / b.v, -1.0 / (b.v * b.v)); }
double value(double x) { return x; }
double value(const Dual& x) { return x.v; }
double arctan_ratio(double q) {  // arctan(sqrt q) / sqrt q, smooth at 0
  if (q > 1e-2) return std::atan(std::sqrt(q)) / std::sqrt(q);
  double sum = 0.0;
  for (int k = 12; k >= 0; --k) sum = 1.0 / (2 * k + 1) - q * sum;
  return sum;
}
double arctan_ratio_slope(double q) {
  if (q > 1e-2) return (1.0 / (1.0 + q) - arctan_ratio(q)) / (2.0 * q);
  double sum = 0.0;
  for (int k = 12; k >= 1; --k) sum = -k / (2.0 * k + 1) - q * sum;
  return sum;
}
double tan_ratio(double w) {  // 2 tan(w/2) / w
  return std::abs(w) < 1e-4 ? 1.0 + w * w / 12.0 : 2.0 * std::tan(0.5 * w) / w;
}
double tan_ratio_slope(double w) {
  if (std::abs(w) < 0.1) {
    const double q = w * w;
    return w * (1.0 / 6 + q * (1.0 / 30 + q * (17.0 / 3360 + q * (31.0 / 45360 + q * 691.0 / 7983360))));
  }
  const double t = std::tan(0.5 * w);
  return (1.0 + t * t) / w - 2.0 * t / (w * w);
}
Dual arctan_ratio(const Dual& q) { return chain(q, arctan_ratio(q.v), arctan_ratio_slope(q.v)); }
Dual tan_ratio(const Dual& w) { return chain(w, tan_ratio(w.v), tan_ratio_slope(w.v)); }

// theta / rho for theta = atan2(rho, z), as a function of p = rho^2: smooth on the axis.
double angle_ratio(double p, double z) {
  if (z > 0 && p < 1e-2 * z * z) return arctan_ratio(p / (z * z)) / z;
  return std::atan2(std::sqrt(p), z) / std::sqrt(p);
}
Dual angle_ratio(const Dual& p, const Dual& z) {
  const double r2 = p.v + z.v * z.v, g = angle_ratio(p.v, z.v);
  const double slope = z.v > 0 && p.v < 1e-2 * z.v * z.v ? arctan_ratio_slope(p.v / (z.v * z.v)) / (z.v * z.v * z.v)
                                                        : (z.v / r2 - g) / (2.0 * p.v);
  return chain(p, g, slope) + chain(z, 0.0, -1.0 / r2);
}

// Where a ray arrives in the plane of the sensor, in focal lengths.
template <class T>
std::array<T, 2> lens(const std::string& model, const std::vector<T>& p, const std::array<T, 3>& X) {
  if (model == "fisheye") {
    const T rho2 = X[0] * X[0] + X[1] * X[1], g = angle_ratio(rho2, X[2]), t2 = g * g * rho2;
    const T kappa = T(1.0) + t2 * (p[4] + t2 * (p[5] + t2 * (p[6] + t2 * p[7])));
    return {kappa * g * X[0], kappa * g * X[1]};
  }
  const T x = X[0] / X[2], y = X[1] / X[2], q = x * x + y * y;
  if (model == "pinhole") return {x, y};
  if (model == "fov") {
    const T A = tan_ratio(p[4]), W = p[4] * A, F = A * arctan_ratio(W * W * q);
    return {F * x, F * y};
  }
  T G = T(1.0) + q * (p[4] + q * (p[5] + q * p[8]));
  if (model == "rational") G = G / (T(1.0) + q * (p[9] + q * (p[10] + q * p[11])));
  const T two(2.0), s = two * (p[7] * x + p[6] * y);
  return {G * x + q * p[7] + s * x, G * y + q * p[6] + s * y};
}
const std::map<std::string, size_t> PARAMETERS = {
    {"pinhole", 4}, {"fov", 5}, {"radtan", 9}, {"rational", 12}, {"fisheye", 8}};

template <class T>
std::array<T, 2> project(const std::string& model, const std::vector<T>& p, const std::array<T, 3>& X) {
  const auto known = PARAMETERS.find(model);
  if (known == PARAMETERS.end()) throw std::invalid_argument(model);
  if (p.size() != known->second) throw std::runtime_error("wrong number of parameters of " + model);
  const std::array<T, 2> xd = lens(model, p, X);
  return {p[0] * xd[0] + p[2], p[1] * xd[1] + p[3]};
}

std::vector<Dual> constants(const Vec& p) { return std::vector<Dual>(p.begin(), p.end()); }
Mat slopes(const std::array<Dual, 2>& uv, int n) {
  Mat J(2, n);
  for (int i = 0; i < 2; ++i)
    for (int k = 0; k < n; ++k) J(i, k) = uv[static_cast<size_t>(i)].d[static_cast<size_t>(k)];
  return J;
}
Mat jacobian_point(const std::string& model, const Vec& p, const Vec& X) {
  return slopes(project<Dual>(model, constants(p), {Dual(X[0], 0), Dual(X[1], 1), Dual(X[2], 2)}), 3);
}
Mat jacobian_intrinsics(const std::string& model, const Vec& p, const Vec& X) {
  std::vector<Dual> q = constants(p);
  for (size_t k = 0; k < p.size(); ++k) q[k] = Dual(p[k], static_cast<int>(k));
  return slopes(project<Dual>(model, q, {Dual(X[0]), Dual(X[1]), Dual(X[2])}), static_cast<int>(p.size()));
}
Mat jacobian_pose(const std::string& model, const Vec& p, const Mat& T_cam_world, const Vec& X_world) {
  const Vec X = turn(T_cam_world) * X_world + shift(T_cam_world);
  Mat D(3, 6);  // of Exp(xi) X at xi = 0: [I, -hat(X)]
  put(D, 0, 0, eye(3));
  put(D, 0, 3, -1.0 * hat(X));
  return jacobian_point(model, p, X) * D;
}

// Is the lens invertible from the axis to here?  Its plane Jacobian must be positive definite all the way.
bool in_field(const std::string& model, const Vec& p, double x, double y, double theta) {
  if (model == "fisheye") {
    for (double t = 0.0; t < 1.0; t += 1e-3) {
      const double a = t * theta, q = a * a;
      if (!(1.0 + q * (3 * p[4] + q * (5 * p[5] + q * (7 * p[6] + q * 9 * p[7]))) > 0.0)) return false;
    }
    return theta < PI - 1e-6;
  }
  if (model == "pinhole" || model == "fov") return true;
  const double r = std::hypot(x, y);
  for (int k = 1; k <= 100; ++k)
    for (int m = 0; m < 48; ++m) {  // all directions: the field is a disc
      const double a = 2.0 * PI * m / 48;
      const Mat J = jacobian_point(model, p, {r * k / 100 * std::cos(a), r * k / 100 * std::sin(a), 1.0});
      const double fx = p[0], fy = p[1], a11 = J(0, 0) / fx, a12 = J(0, 1) / fx, a22 = J(1, 1) / fy;
      if (!(a11 > 0.0 && a11 * a22 - a12 * a12 > 0.0)) return false;
    }
  return true;
}

Json camera_project(const std::string& model, const Vec& p, const Vec& X) {
  const std::array<double, 2> uv = project<double>(model, p, {X[0], X[1], X[2]});
  const double theta = std::atan2(std::hypot(X[0], X[1]), X[2]);
  const bool front = model == "fisheye" || X[2] > 0.0;
  Json list = Json::array();
  list.items = {Json(uv[0]), Json(uv[1])};
  const bool valid = front && in_field(model, p, X[0] / X[2], X[1] / X[2], theta);
  return Json::object({{"uv", list}, {"valid", Json::truth(valid)}});
}

Vec camera_unproject(const std::string& model, const Vec& p, const Vec& uv) {  // unit bearing, or refuses
  project<double>(model, p, {0.0, 0.0, 1.0});  // knows the model, or refuses
  const double xd = (uv[0] - p[2]) / p[0], yd = (uv[1] - p[3]) / p[1], d = std::hypot(xd, yd);
  if (model == "pinhole") return (1.0 / norm({xd, yd, 1.0})) * Vec{xd, yd, 1.0};
  if (model == "fov") {
    if (d * std::abs(p[4]) >= 0.5 * PI) throw std::runtime_error("outside the image of the lens");
    const double t = d * p[4], ratio = std::abs(t) < 1e-4 ? 1.0 + t * t / 3.0 : std::tan(t) / t;
    const double f = ratio / tan_ratio(p[4]);
    return (1.0 / norm({f * xd, f * yd, 1.0})) * Vec{f * xd, f * yd, 1.0};
  }
  if (model == "fisheye") {
    double low = 0.0, high = 0.0;  // the first angle at which d(theta) reaches d, while it still grows
    const auto radius = [&](double t) {
      const double q = t * t;
      return t * (1.0 + q * (p[4] + q * (p[5] + q * (p[6] + q * p[7]))));
    };
    while (radius(high) < d) {
      low = high, high += 1e-3;
      if (high >= PI || !in_field(model, p, 0.0, 0.0, high)) throw std::runtime_error("outside the field");
    }
    for (int k = 0; k < 100; ++k) (radius(0.5 * (low + high)) < d ? low : high) = 0.5 * (low + high);
    const double theta = 0.5 * (low + high), s = d > 0 ? std::sin(theta) / d : 1.0;
    return {s * xd, s * yd, std::cos(theta)};
  }
  double x = xd, y = yd;
  for (int k = 0; k < 100; ++k) {  // Newton, halved while it leads outside the field
    const Vec e{xd - lens<double>(model, p, {x, y, 1.0})[0], yd - lens<double>(model, p, {x, y, 1.0})[1]};
    Mat J = block(jacobian_point(model, p, {x, y, 1.0}), 0, 0, 2, 2);
    for (int j = 0; j < 2; ++j) J(0, j) /= p[0], J(1, j) /= p[1];
    const Vec step = solve(J, e);
    const double cut = std::min(1.0, 0.3 / std::max(norm(step), 1e-300));
    x += cut * step[0], y += cut * step[1];
    if (norm(step) <= 4e-16 * (std::abs(x) + std::abs(y))) break;
  }
  const std::array<double, 2> back = lens<double>(model, p, {x, y, 1.0});
  if (!(std::hypot(back[0] - xd, back[1] - yd) < 1e-9) || !in_field(model, p, x, y, 0.0))
    throw std::runtime_error("outside the field");
  return (1.0 / norm({x, y, 1.0})) * Vec{x, y, 1.0};
}

// ------------------------------------------------------- 6 losses and steps

double loss(const std::string& name, double c, double x, char what) {  // c: cost, i: influence, w: weight
  const double u = (x / c) * (x / c), a = std::abs(x);
  double cost = 0.5 * x * x, weight = 1.0;
  if (name == "huber" && a > c) cost = c * (a - 0.5 * c), weight = c / a;
  else if (name == "cauchy") cost = 0.5 * c * c * std::log1p(u), weight = 1.0 / (1.0 + u);
  else if (name == "geman-mcclure") cost = 0.5 * x * x / (1.0 + u), weight = 1.0 / ((1.0 + u) * (1.0 + u));
  else if (name == "tukey") {
    const double rest = u < 1.0 ? 1.0 - u : 0.0;
    cost = u < 1.0 ? x * x / 6.0 * (3.0 - 3.0 * u + u * u) : c * c / 6.0, weight = rest * rest;
  } else if (name != "l2" && name != "huber") throw std::invalid_argument(name);
  return what == 'c' ? cost : what == 'w' ? weight : weight * x;
}
Vec losses(const std::string& name, double c, Vec x, char what) {
  for (double& v : x) v = loss(name, c, v, what);
  return x;
}
double median(Vec v) {
  if (v.empty()) throw std::runtime_error("no numbers");
  std::sort(v.begin(), v.end());
  const size_t n = v.size();
  return n % 2 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}
Vec damped_step(const Mat& J, const Vec& r, double damping, const Vec& scale) {
  const int m = J.rows, n = J.cols;
  Mat A(m + n, n);
  put(A, 0, 0, J);
  for (int k = 0; k < n; ++k) A(m + k, k) = std::sqrt(damping) * scale[k];
  Vec b = -1.0 * r;
  b.resize(static_cast<size_t>(m + n), 0.0);
  return least_squares(A, b);
}

// --------------------------------------------------------------- 7 filters

struct State {
  Vec x;
  Mat P;
};
State predict(State s, const Vec& control, const Mat& cov_u, double wheelbase, double dt) {
  const int n = static_cast<int>(s.x.size());
  const double v = control[0], steer = control[1], theta = s.x[2], c = std::cos(theta), si = std::sin(theta);
  const double t = std::tan(steer);
  Mat F = eye(n), G(n, 2);
  F(0, 2) = -v * dt * si, F(1, 2) = v * dt * c;
  G(0, 0) = dt * c, G(1, 0) = dt * si, G(2, 0) = dt * t / wheelbase, G(2, 1) = v * dt * (1 + t * t) / wheelbase;
  s.x[0] += v * dt * c, s.x[1] += v * dt * si, s.x[2] = wrap(theta + v * dt * t / wheelbase);
  s.P = F * s.P * transpose(F) + G * cov_u * transpose(G);
  return s;
}
State update(State s, const Vec& ids, const Mat& z, const Mat& cov_z) {  // all sightings at once
  const int n = static_cast<int>(s.x.size()), m = static_cast<int>(ids.size());
  const double c = std::cos(s.x[2]), si = std::sin(s.x[2]);
  Mat H(2 * m, n), cov(2 * m, 2 * m);
  Vec innovation(static_cast<size_t>(2 * m));
  for (int k = 0; k < m; ++k) {
    const int at = 3 + 2 * static_cast<int>(ids[k]);
    if (at < 3 || at + 1 >= n) throw std::runtime_error("no such landmark");
    const double dx = s.x[at] - s.x[0], dy = s.x[at + 1] - s.x[1], a = c * dx + si * dy, b = c * dy - si * dx;
    const double rows[2][5] = {{-c, -si, b, c, si}, {si, -c, -a, -si, c}};
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 3; ++j) H(2 * k + i, j) = rows[i][j];
      for (int j = 0; j < 2; ++j) H(2 * k + i, at + j) = rows[i][3 + j];
      innovation[2 * k + i] = z(k, i) - (i ? b : a);
    }
    put(cov, 2 * k, 2 * k, cov_z);
  }
  const Mat PHt = s.P * transpose(H), S = H * PHt + cov, K = transpose(solve(S, transpose(PHt)));
  s.x = s.x + K * innovation;
  s.x[2] = wrap(s.x[2]);
  const Mat A = eye(n) - K * H;  // Joseph's form: symmetric, and exact for any gain
  s.P = A * s.P * transpose(A) + K * cov * transpose(K);
  return s;
}
State augment(State s, const Vec& z, const Mat& cov_z) {
  const int n = static_cast<int>(s.x.size());
  const Mat turned = so2_exp(s.x[2]);
  const Vec d = turned * z;
  Mat J(2, n), P(n + 2, n + 2);
  J(0, 0) = J(1, 1) = 1.0, J(0, 2) = -d[1], J(1, 2) = d[0];
  const Mat cross = J * s.P;
  put(P, 0, 0, s.P);
  put(P, n, 0, cross);
  put(P, 0, n, transpose(cross));
  put(P, n, n, cross * transpose(J) + turned * cov_z * transpose(turned));
  const Vec x0 = s.x;
  s.x.push_back(x0[0] + d[0]);
  s.x.push_back(x0[1] + d[1]);
  return {s.x, P};
}

// ----------------------------------------------- 8 grids, trajectories, files

Json ray_cells(const Vec& from, const Vec& to) {  // the segment is cut at every grid line it crosses
  Vec cuts{0.0, 1.0};
  for (int k = 0; k < 2; ++k) {
    const double d = to[k] - from[k];
    for (double line = std::ceil(std::min(from[k], to[k])); line <= std::max(from[k], to[k]); line += 1.0)
      if (d != 0.0) cuts.push_back(std::clamp((line - from[k]) / d, 0.0, 1.0));
  }
  std::sort(cuts.begin(), cuts.end());
  Json cells = Json::array();
  std::array<double, 2> last{NAN, NAN};
  for (size_t k = 1; k < cuts.size(); ++k) {
    if (cuts[k] - cuts[k - 1] < 1e-12) continue;
    const double t = 0.5 * (cuts[k - 1] + cuts[k]);
    const std::array<double, 2> cell{std::floor(from[0] + t * (to[0] - from[0])),
                                     std::floor(from[1] + t * (to[1] - from[1]))};
    if (cell == last) continue;
    Json row = Json::array();
    row.items = {Json(cell[0]), Json(cell[1])};
    cells.items.push_back(row);
    last = cell;
  }
  return cells;
}

std::vector<Vec> table_of(const std::string& text, size_t columns) {
  std::vector<Vec> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    Vec row;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));
      if (*end || !std::isfinite(row.back())) throw std::runtime_error(word + " is no finite number");
    }
    if (row.empty()) continue;
    if (row.size() != columns) throw std::runtime_error("a line needs " + std::to_string(columns) + " numbers");
    rows.push_back(row);
  }
  if (rows.empty()) throw std::runtime_error("no data");
  return rows;
}

// ------------------------------------------------------------- 9 the table

Json to(const State& state) { return Json::object({{"x", to(state.x)}, {"P", to(state.P)}}); }

State state(const Json& in) { return {v(in["x"]), m(in["P"])}; }

Json tum(const Json& in) {
  Json times = Json::array(), t = Json::array(), q = Json::array();
  double before = -std::numeric_limits<double>::infinity();
  for (const Vec& row : table_of(s(in["text"]), 8)) {
    if (row[0] < before) throw std::runtime_error("time goes back");
    before = row[0];
    if (std::abs(norm(part(row, 4, 4)) - 1.0) > 1e-3) throw std::runtime_error("a quaternion off unit length");
    times.items.push_back(Json(row[0]));
    t.items.push_back(to(part(row, 1, 3)));
    q.items.push_back(to(Vec{row[7], row[4], row[5], row[6]}));
  }
  return Json::object({{"times", times}, {"t", t}, {"q", q}});
}
Json kitti(const Json& in) {
  Json list = Json::array();
  for (const Vec& row : table_of(s(in["text"]), 12)) {
    Mat T = eye(4);
    std::copy(row.begin(), row.end(), T.a.begin());
    const Mat R = turn(T), D = R * transpose(R) - eye(3);
    const double det = dot(block(R, 0, 0, 1, 3).a, hat(block(R, 1, 0, 1, 3).a) * block(R, 2, 0, 1, 3).a);
    if (largest(D) > 1e-3 || det < 0.0) throw std::runtime_error("this is no rotation");
    list.items.push_back(to(T));
  }
  return list;
}
Json chain(const Json& in) {
  Json list = Json::array();
  Mat T = eye(4);
  list.items.push_back(to(T));
  for (const Json& step : in["steps"].items) list.items.push_back(to(T = T * m(step)));
  return list;
}
Json rpe(const Json& in) {
  const auto &a = in["estimate"].items, &b = in["truth"].items;
  double moved = 0.0, turned = 0.0;
  for (size_t k = 1; k < a.size(); ++k) {
    const Mat step = inverse_of_motion(m(a[k - 1])) * m(a[k]), right = inverse_of_motion(m(b[k - 1])) * m(b[k]);
    const Mat E = inverse_of_motion(right) * step;
    const double angle = norm(so3_log(turn(E))) * 180.0 / PI;
    moved += dot(shift(E), shift(E)), turned += angle * angle;
  }
  const double n = static_cast<double>(a.size()) - 1.0;
  return Json::object({{"trans_rmse", Json(std::sqrt(moved / n))}, {"rot_rmse_deg", Json(std::sqrt(turned / n))}});
}
Vec ackermann(const Vec& pose, const Vec& control, double wheelbase, double dt) {
  const Mat none(3, 3), still(2, 2);
  return predict({pose, none}, control, still, wheelbase, dt).x;
}
Vec front_wheel(const Vec& pose, const Vec& u, double wheelbase, double dt) {
  const double a = pose[2] + u[1], d = u[0] * dt;
  return {pose[0] + d * std::cos(a), pose[1] + d * std::sin(a), wrap(pose[2] + d * std::sin(u[1]) / wheelbase)};
}
Json from_polar(const Json& in) {  // moments of r (cos b, sin b) with Gaussian r and b
  const double r = x(in["polar"].items[0]), b = x(in["polar"].items[1]);
  const double var = std::pow(x(in["sigma_bearing"]), 2), sq = std::pow(x(in["sigma_range"]), 2);
  if (!(r > 0.0)) throw std::runtime_error("a range is positive");
  const double grown = std::expm1(var), twice = std::expm1(2.0 * var);
  Mat D(2, 2);
  D(0, 0) = sq * (1.0 + 0.5 * twice) - 0.5 * r * r * grown * grown, D(1, 1) = 0.5 * (r * r - sq) * twice;
  if (!(D(0, 0) > 0.0 && D(1, 1) > 0.0)) throw std::runtime_error("the covariance is not positive");
  const Mat R = so2_exp(b), cov = R * D * transpose(R);
  return Json::object({{"z", to(std::exp(0.5 * var) * r * block(R, 0, 0, 2, 1).a)}, {"cov", to(cov)}});
}
Json trace(const Json& in) {  // predict, update with the landmarks of the map, add the others
  State now = state(in);
  std::vector<double> map;  // identities, in the order of the state
  Json steps = Json::array();
  const Mat cov_u = m(in["cov_u"]), cov_z = m(in["cov_z"]);
  for (size_t k = 0; k < in["controls"].items.size(); ++k) {
    now = predict(now, v(in["controls"].items[k]), cov_u, x(in["wheelbase"]), x(in["dt"]));
    const Json& seen = in["sightings"].items[k];
    const Vec ids = v(seen["ids"]);
    Vec known;
    Mat z(0, 2);
    std::vector<size_t> fresh;
    for (size_t i = 0; i < ids.size(); ++i) {
      const auto at = std::find(map.begin(), map.end(), ids[i]);
      if (at == map.end()) {
        fresh.push_back(i);
        continue;
      }
      known.push_back(static_cast<double>(at - map.begin()));
      const Vec row = v(seen["z"].items[i]);
      z.a.insert(z.a.end(), row.begin(), row.end());
      ++z.rows;
    }
    if (!known.empty()) now = update(now, known, z, cov_z);
    for (const size_t i : fresh) {
      now = augment(now, v(seen["z"].items[i]), cov_z);
      map.push_back(ids[i]);
    }
    steps.items.push_back(to(now));
  }
  return steps;
}
Vec pose_error(Vec truth, const Vec& estimate) {
  truth = truth - estimate;
  truth[2] = wrap(truth[2]);
  return truth;
}
double nees(const Vec& e, const Mat& P) {
  const Mat L = cholesky(P);
  const Vec y = solve(L, e);
  return dot(y, y);
}
double mad(Vec errors) {
  for (double& e : errors) e = std::abs(e);
  return 1.482602218505602 * median(errors);
}
double plane_mad(const Mat& errors) {
  Vec norms;
  for (int k = 0; k < errors.rows; ++k) norms.push_back(std::hypot(errors(k, 0), errors(k, 1)));
  return 0.8493218002880191 * median(norms);
}
Vec residual(const Json& in) {
  const Mat T = m(in["pose"]);
  const Vec X = turn(T) * v(in["X_world"]) + shift(T), z = v(in["uv"]);
  const std::array<double, 2> uv = project<double>(s(in["model"]), v(in["params"]), {X[0], X[1], X[2]});
  return {uv[0] - z[0], uv[1] - z[1]};
}
double log_odds(double p) {
  if (!(p >= 0.0 && p <= 1.0)) throw std::runtime_error("a probability lies between 0 and 1");
  return std::log(p) - std::log1p(-p);
}

const std::map<std::string, std::function<Json(const Json&)>> TABLE = {
    {"so2.exp", ANSWER(so2_exp(x(in["angle"])))},
    {"so2.wrap", ANSWER(wrap(x(in["angle"])))},
    {"se2.exp", ANSWER(se2_exp(v(in["xi"])))},
    {"se2.log", ANSWER(se2_log(v(in["x"])))},
    {"se2.compose", ANSWER(se2_compose(v(in["a"]), v(in["b"])))},
    {"se2.inverse", ANSWER(se2_inverse(v(in["x"])))},
    {"se2.adjoint", ANSWER(se2_adjoint(v(in["x"])))},
    {"se2.left_jacobian", ANSWER(phi1(se2_ad(v(in["xi"]))))},
    {"so3.exp", ANSWER(so3_exp(v(in["phi"])))},
    {"so3.log", ANSWER(so3_log(m(in["R"])))},
    {"so3.left_jacobian", ANSWER(phi1(hat(v(in["phi"]))))},
    {"so3.left_jacobian_inverse", ANSWER(so3_left_inverse(v(in["phi"])))},
    {"so3.interpolate", ANSWER(so3_between(m(in["a"]), m(in["b"]), x(in["fraction"])))},
    {"so3.nearest", ANSWER(so3_nearest(m(in["M"])))},
    {"quaternion.from_rotation", ANSWER(quaternion(m(in["R"])))},
    {"quaternion.to_rotation", ANSWER(rotation(v(in["q"])))},
    {"se3.exp", ANSWER(se3_exp(v(in["xi"])))},
    {"se3.log", ANSWER(se3_log(m(in["T"])))},
    {"se3.compose", ANSWER(m(in["a"]) * m(in["b"]))},
    {"se3.inverse", ANSWER(inverse_of_motion(m(in["T"])))},
    {"se3.act", ANSWER(turn(m(in["T"])) * v(in["x"]) + shift(m(in["T"])))},
    {"se3.adjoint", ANSWER(se3_adjoint(m(in["T"])))},
    {"se3.left_jacobian", ANSWER(phi1(se3_ad(v(in["xi"]))))},
    {"se3.left_jacobian_inverse", ANSWER(inverse(phi1(se3_ad(v(in["xi"])))))},
    {"se3.interpolate", ANSWER(se3_between(m(in["a"]), m(in["b"]), x(in["fraction"])))},
    {"sim3.exp", ANSWER(sim3_exp(v(in["xi"])))},
    {"sim3.log", ANSWER(sim3_log(m(in["S"])))},
    {"sim3.compose", ANSWER(m(in["a"]) * m(in["b"]))},
    {"sim3.inverse", ANSWER(inverse_of_similarity(m(in["S"])))},
    {"sim3.act", ANSWER(turn(m(in["S"])) * v(in["x"]) + shift(m(in["S"])))},
    {"sim3.adjoint", ANSWER(sim3_adjoint(m(in["S"])))},
    {"camera.project", ANSWER(camera_project(s(in["model"]), v(in["params"]), v(in["X_cam"])))},
    {"camera.unproject",
     [](const Json& in) {
       const Vec ray = camera_unproject(s(in["model"]), v(in["params"]), v(in["uv"]));
       return Json::object({{"bearing", to(ray)}, {"valid", Json::truth(true)}});
     }},
    {"camera.jacobian_point", ANSWER(jacobian_point(s(in["model"]), v(in["params"]), v(in["X_cam"])))},
    {"camera.jacobian_intrinsics", ANSWER(jacobian_intrinsics(s(in["model"]), v(in["params"]), v(in["X_cam"])))},
    {"camera.jacobian_pose",
     ANSWER(jacobian_pose(s(in["model"]), v(in["params"]), m(in["pose"]), v(in["X_world"])))},
    {"camera.jacobian_rig",
     ANSWER(jacobian_pose(s(in["model"]), v(in["params"]), m(in["T_cam_rig"]) * m(in["pose"]), v(in["X_world"])) *
            se3_adjoint(m(in["T_cam_rig"])))},
    {"multiview.essential", ANSWER(hat(shift(m(in["T_b_a"]))) * turn(m(in["T_b_a"])))},
    {"multiview.camera_from_world", ANSWER(m(in["R_cam_world"]) * (v(in["X_world"]) - v(in["p_world"])))},
    {"loss.cost", ANSWER(losses(s(in["name"]), x(in["c"]), v(in["x"]), 'c'))},
    {"loss.influence", ANSWER(losses(s(in["name"]), x(in["c"]), v(in["x"]), 'i'))},
    {"loss.weight", ANSWER(losses(s(in["name"]), x(in["c"]), v(in["x"]), 'w'))},
    {"scale.mad", ANSWER(mad(v(in["errors"])))},
    {"scale.norm", ANSWER(plane_mad(m(in["errors"])))},
    {"least_squares.gauss_newton_step", ANSWER(least_squares(m(in["J"]), -1.0 * v(in["r"])))},
    {"least_squares.lm_step", ANSWER(damped_step(m(in["J"]), v(in["r"]), x(in["damping"]), v(in["scale"])))},
    {"bundle.residual", ANSWER(residual(in))},
    {"vehicle.ackermann", ANSWER(ackermann(v(in["x"]), v(in["control"]), x(in["wheelbase"]), x(in["dt"])))},
    {"vehicle.front_wheel", ANSWER(front_wheel(v(in["x"]), v(in["control"]), x(in["wheelbase"]), x(in["dt"])))},
    {"ekf.predict", ANSWER(predict(state(in), v(in["control"]), m(in["cov_u"]), x(in["wheelbase"]), x(in["dt"])))},
    {"ekf.update", ANSWER(update(state(in), v(in["ids"]), m(in["z"]), m(in["cov_z"])))},
    {"ekf.augment", ANSWER(augment(state(in), v(in["z"]), m(in["cov_z"])))},
    {"ekf.from_polar", ANSWER(from_polar(in))},
    {"ekf.trace", ANSWER(trace(in))},
    {"consistency.pose_error", ANSWER(pose_error(v(in["truth"]), v(in["estimate"])))},
    {"consistency.nees", ANSWER(nees(v(in["error"]), m(in["P"])))},
    {"grid.log_odds", ANSWER(log_odds(x(in["probability"])))},
    {"grid.probability", ANSWER(1.0 / (1.0 + std::exp(-x(in["log_odds"]))))},
    {"grid.update", ANSWER(log_odds(x(in["prior"])) + log_odds(x(in["measured"])))},
    {"grid.ray_cells", ANSWER(ray_cells(v(in["start"]), v(in["end"])))},
    {"trajectory.rpe", ANSWER(rpe(in))},
    {"trajectory.chain", ANSWER(chain(in))},
    {"format.tum", ANSWER(tum(in))},
    {"format.kitti", ANSWER(kitti(in))},
};

// ---------------------------------------------------------- 10 the answers

Json answer(const Json& request) {
  const Json id = request["id"];
  const auto found = TABLE.find(request["function"].text);
  if (found == TABLE.end()) return Json::object({{"id", id}, {"unsupported", Json::truth(true)}});
  try {
    return Json::object({{"id", id}, {"value", found->second(request["inputs"])}});
  } catch (const std::invalid_argument&) {  // a model or a loss that this program does not have
    return Json::object({{"id", id}, {"unsupported", Json::truth(true)}});
  } catch (const std::exception& error) {
    return Json::object({{"id", id}, {"error", Json(std::string(error.what()))}});
  }
}

int main() {
  std::ios::sync_with_stdio(false);
  for (std::string line; std::getline(std::cin, line);) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Json reply;
    try {
      reply = answer(Reader(line).all());
    } catch (const std::exception& error) {
      reply = Json::object({{"id", Json()}, {"error", Json(std::string(error.what()))}});
    }
    std::string out;
    write(out, reply);
    std::cout << out << "\n" << std::flush;  // the other side waits for it
  }
  return 0;
}
