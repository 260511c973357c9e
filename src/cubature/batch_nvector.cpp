#include "wienertree/cubature/batch_nvector.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <new>

namespace wienertree {
namespace {

struct Content {
  const BatchShape* shape;
  std::unique_ptr<double[]> values;
};

Content& content(N_Vector x) { return *static_cast<Content*>(x->content); }
const BatchShape& shape(N_Vector x) { return *content(x).shape; }
double* component(N_Vector x, std::size_t i) { return content(x).values.get() + i * shape(x).capacity; }

/// Eight nodes. Operations run over whole octets, by SIMD registers; what they make of the lanes beyond the
/// last node is never used.
using Octet = Eigen::Array<double, 8, 1>;
constexpr std::size_t octet = 8;

Octet load(const double* p) { return Octet::Map(p); }

/// z = f(x..), elementwise; z may be one of x.
template <class F, class... Vectors>
void transform(F f, N_Vector z, Vectors... x) {
  const BatchShape& s = shape(z);
  for (std::size_t i = 0; i < s.components; ++i) {
    double* out = component(z, i);
    [&](auto... in) {
      for (std::size_t n = 0; n < s.nodes; n += octet) Octet::Map(out + n) = f(load(in + n)...);
    }(component(x, i)...);
  }
}

/// max over nodes of sqrt((1/d) sum_i term(i, n)), `term` for eight nodes at once; NaN as soon as one is not
/// finite.
template <class Term>
double worst_node(const BatchShape& s, Term term) {
  Octet worst = Octet::Zero(), poison = Octet::Zero();
  for (std::size_t n = 0; n < s.nodes; n += octet) {
    Octet sum = Octet::Zero();
    for (std::size_t i = 0; i < s.components; ++i) sum += term(i, n);
    for (std::size_t beyond = s.nodes - n; beyond < octet; ++beyond)
      sum[static_cast<Eigen::Index>(beyond)] = 0.0;
    worst = worst.max(sum);
    poison += sum - sum;  // 0 or NaN
  }
  return std::sqrt(worst.maxCoeff() / static_cast<double>(s.components)) + poison.sum();
}

double norm(N_Vector x, N_Vector w) {
  return worst_node(shape(x), [=](std::size_t i, std::size_t n) -> Octet {
    return (load(component(x, i) + n) * load(component(w, i) + n)).square();
  });
}

double masked_norm(N_Vector x, N_Vector w, N_Vector mask) {
  return worst_node(shape(x), [=](std::size_t i, std::size_t n) -> Octet {
    const Octet scaled = load(component(x, i) + n) * load(component(w, i) + n);
    return (load(component(mask, i) + n) > 0.0).select(scaled.square(), 0.0);
  });
}

double largest(N_Vector x) {
  double value = 0;
  for (std::size_t i = 0; i < shape(x).components; ++i)
    for (std::size_t n = 0; n < shape(x).nodes; ++n) value = std::max(value, std::abs(component(x, i)[n]));
  return value;
}

double smallest(N_Vector x) {
  double value = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < shape(x).components; ++i)
    for (std::size_t n = 0; n < shape(x).nodes; ++n) value = std::min(value, component(x, i)[n]);
  return value;
}

/// SUNDIALS' sense of a failed clone is a null pointer.
N_Vector clone(N_Vector x) {
  try {
    N_Vector result = make_batch_nvector(shape(x), x->sunctx);
    return result;
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

void destroy(N_Vector x) {
  if (x == nullptr) return;
  delete static_cast<Content*>(x->content);
  x->content = nullptr;
  N_VFreeEmpty(x);
}

void install(_generic_N_Vector_Ops& ops) {
  ops.nvgetvectorid = [](N_Vector) { return SUNDIALS_NVEC_CUSTOM; };
  ops.nvclone = clone;
  ops.nvdestroy = destroy;
  ops.nvgetlength = [](N_Vector x) {
    return static_cast<sunindextype>(shape(x).components * shape(x).nodes);
  };
  ops.nvlinearsum = [](double a, N_Vector x, double b, N_Vector y, N_Vector z) {
    transform([=](const Octet& u, const Octet& v) -> Octet { return a * u + b * v; }, z, x, y);
  };
  ops.nvconst = [](double c, N_Vector z) { transform([=]() -> Octet { return Octet::Constant(c); }, z); };
  ops.nvprod = [](N_Vector x, N_Vector y, N_Vector z) {
    transform([](const Octet& u, const Octet& v) -> Octet { return u * v; }, z, x, y);
  };
  ops.nvdiv = [](N_Vector x, N_Vector y, N_Vector z) {
    transform([](const Octet& u, const Octet& v) -> Octet { return u / v; }, z, x, y);
  };
  ops.nvscale = [](double c, N_Vector x, N_Vector z) {
    transform([=](const Octet& u) -> Octet { return c * u; }, z, x);
  };
  ops.nvabs = [](N_Vector x, N_Vector z) {
    transform([](const Octet& u) -> Octet { return u.abs(); }, z, x);
  };
  ops.nvinv = [](N_Vector x, N_Vector z) {
    transform([](const Octet& u) -> Octet { return 1.0 / u; }, z, x);
  };
  ops.nvaddconst = [](N_Vector x, double b, N_Vector z) {
    transform([=](const Octet& u) -> Octet { return u + b; }, z, x);
  };
  ops.nvmaxnorm = largest;
  ops.nvmin = smallest;
  ops.nvwrmsnorm = norm;
  ops.nvwrmsnormmask = masked_norm;
}

}  // namespace

N_Vector make_batch_nvector(const BatchShape& shape, SUNContext context) {
  assert(shape.capacity % octet == 0);
  auto data = std::make_unique<Content>();
  data->shape = &shape;
  data->values = std::make_unique<double[]>(shape.components * shape.capacity);
  N_Vector result = N_VNewEmpty(context);
  if (result == nullptr) throw std::bad_alloc();
  install(*result->ops);
  result->content = data.release();
  return result;
}

BatchView batch_of(N_Vector x) {
  return {content(x).values.get(), shape(x).components, shape(x).nodes, shape(x).capacity};
}

}  // namespace wienertree
