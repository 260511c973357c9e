// The interpreter of a tape, compiled once for each machine code. The including file defines, in an unnamed
// namespace,
//
//   struct Machine {
//     using Vector = ..;                         // `width` doubles
//     static constexpr size_t width = ..;
//     static Vector load(const double*);
//     static void store(double*, Vector);
//     static Vector broadcast(double);
//     static Vector add(Vector, Vector);  ..     // every operation of tape_kernel.hpp, by its name
//   };
//
// Everything here has internal linkage: the same template instantiated under two instruction sets must stay
// two functions.

namespace wienertree {
namespace {

/// An operand that has a value per node, or one for all.
struct PerNode {
  const double* values;
  PerNode(double* const* slots, const double*, uint32_t index) : values(slots[index]) {}
  Machine::Vector operator[](size_t lane) const { return Machine::load(values + lane); }
};
struct Shared {
  Machine::Vector value;
  Shared(double* const*, const double* scalars, uint32_t index) : value(Machine::broadcast(scalars[index])) {}
  Machine::Vector operator[](size_t) const { return value; }
};

void run_program(const TapeInstruction* program, size_t instructions, double* const* slots,
                 const double* scalars, size_t lanes) {
  for (const TapeInstruction* i = program; i != program + instructions; ++i) {
    double* const target = slots[i->target];
#define WIENERTREE_LANES for (size_t lane = 0; lane < lanes; lane += Machine::width)
#define WIENERTREE_CASE_1(code, A, expression)                  \
  case TapeCode::code: {                                        \
    const A a(slots, scalars, i->a);                            \
    WIENERTREE_LANES Machine::store(target + lane, expression); \
    break;                                                      \
  }
#define WIENERTREE_CASE_2(code, A, B, name)                                          \
  case TapeCode::code: {                                                             \
    const A a(slots, scalars, i->a);                                                 \
    const B b(slots, scalars, i->b);                                                 \
    WIENERTREE_LANES Machine::store(target + lane, Machine::name(a[lane], b[lane])); \
    break;                                                                           \
  }
#define WIENERTREE_CASE_3(code, B, C, name)                                                   \
  case TapeCode::code: {                                                                      \
    const PerNode a(slots, scalars, i->a);                                                    \
    const B b(slots, scalars, i->b);                                                          \
    const C c(slots, scalars, i->c);                                                          \
    WIENERTREE_LANES Machine::store(target + lane, Machine::name(a[lane], b[lane], c[lane])); \
    break;                                                                                    \
  }
    switch (i->code) {
      WIENERTREE_CASE_1(copy_v, PerNode, a[lane])
      WIENERTREE_CASE_1(copy_s, Shared, a[lane])
#define X(name, ...) WIENERTREE_CASE_1(name##_v, PerNode, Machine::name(a[lane]))
      WIENERTREE_TAPE_UNARY(X)
      WIENERTREE_ELEMENTARY_FUNCTIONS(X)
#undef X
#define X(name)                                        \
  WIENERTREE_CASE_2(name##_vv, PerNode, PerNode, name) \
  WIENERTREE_CASE_2(name##_vs, PerNode, Shared, name)  \
  WIENERTREE_CASE_2(name##_sv, Shared, PerNode, name)
      WIENERTREE_TAPE_BINARY(X)
#undef X
#define X(name)                                         \
  WIENERTREE_CASE_3(name##_vvv, PerNode, PerNode, name) \
  WIENERTREE_CASE_3(name##_vvs, PerNode, Shared, name)  \
  WIENERTREE_CASE_3(name##_vsv, Shared, PerNode, name)  \
  WIENERTREE_CASE_3(name##_vss, Shared, Shared, name)
      WIENERTREE_TAPE_FUSED(X)
#undef X
    }
#undef WIENERTREE_CASE_3
#undef WIENERTREE_CASE_2
#undef WIENERTREE_CASE_1
#undef WIENERTREE_LANES
  }
}

}  // namespace
}  // namespace wienertree
