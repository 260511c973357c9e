#include "wienertree/cubature/runge_kutta_pairs.hpp"

namespace wienertree {
namespace {

namespace cash_karp {

constexpr std::array<double, 15> a = {
    // 2
    1. / 5,
    // 3
    3. / 40, 9. / 40,
    // 4
    3. / 10, -9. / 10, 6. / 5,
    // 5
    -11. / 54, 5. / 2, -70. / 27, 35. / 27,
    // 6
    1631. / 55296, 175. / 512, 575. / 13824, 44275. / 110592, 253. / 4096};
constexpr std::array<double, 6> b = {37. / 378, 0, 250. / 621, 125. / 594, 0, 512. / 1771};
constexpr std::array<double, 6> b_4 = {2825. / 27648, 0,     18575. / 48384, 13525. / 55296,
                                       277. / 14336,  1. / 4};
constexpr std::array<double, 6> b_3 = {19. / 54, 0, -10. / 27, 55. / 54, 0, 0};

}  // namespace cash_karp

namespace prince_dormand {

constexpr std::array<double, 78> a = {
    // 2
    1. / 18,
    // 3
    1. / 48, 1. / 16,
    // 4
    1. / 32, 0, 3. / 32,
    // 5
    5. / 16, 0, -75. / 64, 75. / 64,
    // 6
    3. / 80, 0, 0, 3. / 16, 3. / 20,
    // 7
    29443841. / 614563906, 0, 0, 77736538. / 692538347, -28693883. / 1125000000, 23124283. / 1800000000,
    // 8
    16016141. / 946692911, 0, 0, 61564180. / 158732637, 22789713. / 633445777, 545815736. / 2771057229,
    -180193667. / 1043307555,
    // 9
    39632708. / 573591083, 0, 0, -433636366. / 683701615, -421739975. / 2616292301, 100302831. / 723423059,
    790204164. / 839813087, 800635310. / 3783071287,
    // 10
    246121993. / 1340847787, 0, 0, -37695042795. / 15268766246, -309121744. / 1061227803,
    -12992083. / 490766935, 6005943493. / 2108947869, 393006217. / 1396673457, 123872331. / 1001029789,
    // 11
    -1028468189. / 846180014, 0, 0, 8478235783. / 508512852, 1311729495. / 1432422823,
    -10304129995. / 1701304382, -48777925059. / 3047939560, 15336726248. / 1032824649,
    -45442868181. / 3398467696, 3065993473. / 597172653,
    // 12
    185892177. / 718116043, 0, 0, -3185094517. / 667107341, -477755414. / 1098053517, -703635378. / 230739211,
    5731566787. / 1027545527, 5232866602. / 850066563, -4093664535. / 808688257, 3962137247. / 1805957418,
    65686358. / 487910083,
    // 13
    403863854. / 491063109, 0, 0, -5068492393. / 434740067, -411421997. / 543043805, 652783627. / 914296604,
    11173962825. / 925320556, -13158990841. / 6184727034, 3936647629. / 1978049680, -160528059. / 685178525,
    248638103. / 1413531060, 0};
constexpr std::array<double, 13> b = {14005451. / 335480064,
                                      0,
                                      0,
                                      0,
                                      0,
                                      -59238493. / 1068277825,
                                      181606767. / 758867731,
                                      561292985. / 797845732,
                                      -1041891430. / 1371343529,
                                      760417239. / 1151165299,
                                      118820643. / 751138087,
                                      -528747749. / 2220607170,
                                      1. / 4};
constexpr std::array<double, 13> b_7 = {13451932. / 455176623,
                                        0,
                                        0,
                                        0,
                                        0,
                                        -808719846. / 976000145,
                                        1757004468. / 5645159321,
                                        656045339. / 265891186,
                                        -3867574721. / 1518517206,
                                        465885868. / 322736535,
                                        53011238. / 667516719,
                                        2. / 45,
                                        0};
constexpr std::array<double, 13> b_quadrature = {0.1755000093575989712158498,
                                                 0,
                                                 0,
                                                 0,
                                                 0,
                                                 0,
                                                 0,
                                                 0,
                                                 1.194718507266108380699175,
                                                 -0.5581808792631362146525773,
                                                 0,
                                                 0.187962362639428862737553,
                                                 0};

}  // namespace prince_dormand

template <std::size_t s>
constexpr std::array<double, s> difference(const std::array<double, s>& x, const std::array<double, s>& y) {
  std::array<double, s> result{};
  for (std::size_t i = 0; i < s; ++i) result[i] = x[i] - y[i];
  return result;
}

constexpr auto cash_karp_e = difference(cash_karp::b, cash_karp::b_4);
constexpr auto cash_karp_g = difference(cash_karp::b, cash_karp::b_3);
constexpr auto prince_dormand_e = difference(prince_dormand::b, prince_dormand::b_7);
constexpr auto prince_dormand_g = difference(prince_dormand::b, prince_dormand::b_quadrature);

}  // namespace

const RungeKuttaPair& cash_karp_5() {
  static constexpr RungeKuttaPair pair{"Cash-Karp 5(4)", 6,           5, 4, cash_karp::a, cash_karp::b,
                                       cash_karp_e,      cash_karp_g, 3, 3, 0.1};
  return pair;
}

const RungeKuttaPair& prince_dormand_8() {
  static constexpr RungeKuttaPair pair{
      "Prince-Dormand 8(7)", 13, 8, 7,  prince_dormand::a, prince_dormand::b, prince_dormand_e,
      prince_dormand_g,      4,  4, 3.0};
  return pair;
}

}  // namespace wienertree
