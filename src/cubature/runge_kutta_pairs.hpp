#pragma once
/// Embedded explicit Runge-Kutta pairs for autonomous equations dx/du = f(x).
///
///     k_i = f(x + h sum_{j<i} a_ij k_j),  i = 1..s,        x_1 = x + h sum_i b_i k_i
///
/// x_1 has order p. Its error per unit of u is estimated by |sum_i e_i k_i| = O(h^q), or, where a second row
/// e' of lower order is given, by
///
///     (sum e_i k_i)^2 / sqrt((sum e_i k_i)^2 + 0.01 (sum e'_i k_i)^2) = O(h^q).
///
/// Only the coefficients are here; the order conditions of every pair are checked over all rooted trees by
/// the tests.
#include <array>
#include <span>
#include <string_view>

namespace wienertree {

struct RungeKuttaPair {
  std::string_view name;
  int stages = 0;             ///< s
  int order = 0;              ///< p
  int estimate_order = 0;     ///< q
  std::span<const double> a;  ///< rows 2..s of the strict lower triangle, packed: a_21, a_31, a_32, a_41, ..
  std::span<const double> b;  ///< s
  std::span<const double> e;  ///< s: estimate; b - e are weights of a lower order
  std::span<const double> e_low;  ///< s, or empty: e' above
  /// a_{i+1,1} .. a_{i+1,i}, for i = 0 .. s-1.
  std::span<const double> row(std::size_t i) const {
    return i == 0 ? a.first(0) : a.subspan(i * (i - 1) / 2, i);
  }
};

namespace cash_karp_5_coefficients {
inline constexpr std::array<double, 15> a = {1. / 5,                                             //
                                             3. / 40,       9. / 40,                             //
                                             3. / 10,       -9. / 10,   6. / 5,                  //
                                             -11. / 54,     5. / 2,     -70. / 27,    35. / 27,  //
                                             1631. / 55296, 175. / 512, 575. / 13824, 44275. / 110592,
                                             253. / 4096};
inline constexpr std::array<double, 6> b = {37. / 378, 0, 250. / 621, 125. / 594, 0, 512. / 1771};
inline constexpr std::array<double, 6> e = {
    b[0] - 2825. / 27648, 0, b[2] - 18575. / 48384, b[3] - 13525. / 55296, -277. / 14336, b[5] - 1. / 4};
}  // namespace cash_karp_5_coefficients

/// Order 5, six stages, error estimate of order 4 (Cash, Karp 1990, A variable order Runge-Kutta method for
/// initial value problems with rapidly varying right-hand sides, ACM Trans. Math. Softw. 16, 201-222).
inline constexpr RungeKuttaPair cash_karp_5{"Cash-Karp 5(4)",
                                            6,
                                            5,
                                            4,
                                            cash_karp_5_coefficients::a,
                                            cash_karp_5_coefficients::b,
                                            cash_karp_5_coefficients::e,
                                            {}};

namespace dormand_prince_8_coefficients {
inline constexpr std::array<double, 66> a = {
    // 2
    5.26001519587677318785587544488e-2,
    // 3
    1.97250569845378994544595329183e-2, 5.91751709536136983633785987549e-2,
    // 4
    2.95875854768068491816892993775e-2, 0, 8.87627564304205475450678981324e-2,
    // 5
    2.41365134159266685502369798665e-1, 0, -8.84549479328286085344864962717e-1,
    9.24834003261792003115737966543e-1,
    // 6
    3.7037037037037037037037037037e-2, 0, 0, 1.70828608729473871279604482173e-1,
    1.25467687566822425016691814123e-1,
    // 7
    3.7109375e-2, 0, 0, 1.70252211019544039314978060272e-1, 6.02165389804559606850219397283e-2, -1.7578125e-2,
    // 8
    3.70920001185047927108779319836e-2, 0, 0, 1.70383925712239993810214054705e-1,
    1.07262030446373284651809199168e-1, -1.53194377486244017527936158236e-2,
    8.27378916381402288758473766002e-3,
    // 9
    6.24110958716075717114429577812e-1, 0, 0, -3.36089262944694129406857109825,
    -8.68219346841726006818189891453e-1, 2.75920996994467083049415600797e1, 2.01540675504778934086186788979e1,
    -4.34898841810699588477366255144e1,
    // 10
    4.77662536438264365890433908527e-1, 0, 0, -2.48811461997166764192642586468,
    -5.90290826836842996371446475743e-1, 2.12300514481811942347288949897e1, 1.52792336328824235832596922938e1,
    -3.32882109689848629194453265587e1, -2.03312017085086261358222928593e-2,
    // 11
    -9.3714243008598732571704021658e-1, 0, 0, 5.18637242884406370830023853209,
    1.09143734899672957818500254654, -8.14978701074692612513997267357, -1.85200656599969598641566180701e1,
    2.27394870993505042818970056734e1, 2.49360555267965238987089396762, -3.0467644718982195003823669022,
    // 12
    2.27331014751653820792359768449, 0, 0, -1.05344954667372501984066689879e1,
    -2.00087205822486249909675718444, -1.79589318631187989172765950534e1, 2.79488845294199600508499808837e1,
    -2.85899827713502369474065508674, -8.87285693353062954433549289258, 1.23605671757943030647266201528e1,
    6.43392746015763530355970484046e-1};
inline constexpr std::array<double, 12> b = {5.42937341165687622380535766363e-2,
                                             0,
                                             0,
                                             0,
                                             0,
                                             4.45031289275240888144113950566,
                                             1.89151789931450038304281599044,
                                             -5.8012039600105847814672114227,
                                             3.1116436695781989440891606237e-1,
                                             -1.52160949662516078556178806805e-1,
                                             2.01365400804030348374776537501e-1,
                                             4.47106157277725905176885569043e-2};
inline constexpr std::array<double, 12> e = {0.1312004499419488073250102996e-01,
                                             0,
                                             0,
                                             0,
                                             0,
                                             -0.1225156446376204440720569753e+01,
                                             -0.4957589496572501915214079952,
                                             0.1664377182454986536961530415e+01,
                                             -0.3503288487499736816886487290,
                                             0.3341791187130174790297318841,
                                             0.8192320648511571246570742613e-01,
                                             -0.2235530786388629525884427845e-01};
inline constexpr std::array<double, 12> e_low = {b[0] - 0.244094488188976377952755905512,
                                                 0,
                                                 0,
                                                 0,
                                                 0,
                                                 b[5],
                                                 b[6],
                                                 b[7],
                                                 b[8] - 0.733846688281611857341361741547,
                                                 b[9],
                                                 b[10],
                                                 b[11] - 0.220588235294117647058823529412e-01};
}  // namespace dormand_prince_8_coefficients

/// Order 8, twelve stages; e of order 5 and e' of order 3 combine to an estimate of order 7: the pair of
/// DOP853 (Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, 2nd ed., section II.10;
/// coefficients as in the authors' published code).
inline constexpr RungeKuttaPair dormand_prince_8{"Dormand-Prince 8(5,3)",
                                                 12,
                                                 8,
                                                 7,
                                                 dormand_prince_8_coefficients::a,
                                                 dormand_prince_8_coefficients::b,
                                                 dormand_prince_8_coefficients::e,
                                                 dormand_prince_8_coefficients::e_low};

}  // namespace wienertree
