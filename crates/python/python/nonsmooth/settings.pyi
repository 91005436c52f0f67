"""Settings of the solvers. Written by `python -m nonsmooth.stubs`."""

from typing import Any, ClassVar, Literal, Mapping, Optional, Union

from . import _nonsmooth

class Settings:
    solver: ClassVar[str]
    kinds: ClassVar[tuple[str, ...]]
    known: ClassVar[Mapping[str, _nonsmooth.Setting]]
    name: str
    settings: dict[str, object]
    def __init__(self, **settings: object) -> None: ...
    def __getattr__(self, key: str) -> Any: ...
    def __setattr__(self, key: str, value: object) -> None: ...

class Prefixed(Settings):
    usual: ClassVar[Optional[str]]
    def __init__(self, solver: Union[str, Settings] = ..., **settings: object) -> None: ...

class Entry:
    name: str
    is_prefix: bool
    kinds: list[str]
    settings: dict[str, _nonsmooth.Setting]
    @property
    def usual(self) -> Optional[str]: ...
    def doc(self) -> str: ...

CLASSES: dict[str, type[Settings]]

def argument(key: str) -> str: ...
def registered(settings: Mapping[str, object]) -> dict[str, object]: ...
def class_name(solver: str) -> str: ...
def python_type(setting: _nonsmooth.Setting) -> str: ...
def entries() -> dict[str, Entry]: ...
def solvers(problem: object = None) -> list[str]: ...

class Admm(Settings):
    """admm: alternating direction method of multipliers with exact projection on the cones

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Needs W (or M) with a positive semidefinite symmetric part; the full W is factorised, so it need not
    be symmetric.

    Settings
    --------
    rule : Literal['fixed', 'balanced'], default 'balanced'
        How rho is chosen.
    rho : float, default 0.0
        The penalty in units of w_c; 0 takes the geometric mean of the extreme eigenvalues of W in
        that metric.
    alpha : float, default 1.6
        Over-relaxation, in [1, 1.9].
    eta : float, default 1e-06
        The weight of the step from the last r, in units of w_c.
    adapt_every : int, default 20
        Steps between two adaptations of rho.
    factorisations : int, default 30
        At most this many factorisations in a solve, at least 2.
    anderson : int, default 0
        Anderson acceleration with at most this many differences; 0 for none.
    check_every : int, default 20
        Steps between two evaluations of the true residual, unless the cheap estimate asks for one
        earlier.

    References: Carpentier2024, EcksteinBertsekas1992, BoydParikhChuPeleatoEckstein2011.
    """

    def __init__(
        self,
        *,
        rule: Literal['fixed', 'balanced'] = ...,
        rho: float = ...,
        alpha: float = ...,
        eta: float = ...,
        adapt_every: int = ...,
        factorisations: int = ...,
        anderson: int = ...,
        check_every: int = ...,
    ) -> None: ...

class Auto(Settings):
    """auto: needs no setting: sweeps, a search for rest, interior point, proximal semismooth Newton, ADMM,
    each while it promises more than the next (friction_local_2d, friction_local_3d, friction_global_2d,
    friction_global_3d, rolling_friction_local_3d, rolling_friction_global_3d)
    auto: needs no setting: a plan of solvers by size, class and structure, until one solves the problem
    or proves that there is no solution (lcp, mlcp, hlcp, box_lcp, mcp)
    auto: needs no setting: over boxes and polyhedra the auto of mcp behind multipliers, then
    projections (vi)

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d, lcp, mlcp, hlcp, box_lcp, mcp, vi.

    Settings
    --------
    interior : bool, default True
        Whether an interior point may make the start; false goes from the sweeps to the proximal
        point method at once.
    in_turn : bool, default True
        Whether, where no strategy helps, the motion of what moves and the impulses of all are
        sought in turn; false goes on with other strategies.
    strategies : int, default 12
        Give up after this many strategies in a row that have not halved the error; 0 goes on until
        a limit ends the solve.
    enumerate_below : int, default 20
        Enumerate all complementary bases, as the last resort, up to this many complementary pairs.
    restarts : int, default 20
        Perturbed starts of a nonlinear problem that are tried in a turn where nothing has solved
        it: two turns without a limit on time, else until it is over.
    multipliers : int, default 1000
        The iterations of the complementarity problem's `auto` in its first turn; ten times as many
        in each that follows.
    projections : int, default 5000
        The iterations of a projection method in its first turn; four times as many in each that
        follows.

    References: AcaryBremondHuber2018, AlartCurnier1991, Acary2018, HintermullerItoKunisch2002,
    Cadoux2009, Anderson1965, CottlePangStone2009, FacchineiPang2003, Munson2002.
    """

    def __init__(
        self,
        *,
        interior: bool = ...,
        in_turn: bool = ...,
        strategies: int = ...,
        enumerate_below: int = ...,
        restarts: int = ...,
        multipliers: int = ...,
        projections: int = ...,
    ) -> None: ...

class Bard(Settings):
    """bard: Bard's principal pivoting: the most negative variable changes sides; least index where that
    cycles

    For problems lcp, mlcp.

    Needs the entries of M; no zero on the tableau's diagonal (M a P-matrix: guaranteed).

    Settings
    --------
    protect : bool, default True
        Go on with the least index once a basis has come back; otherwise stop and say that the
        pivots cycle.

    References: Acary2018, Murty1988, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        protect: bool = ...,
    ) -> None: ...

class BlockPivoting(Settings):
    """block_pivoting: block principal pivoting: every variable of the wrong sign changes sides, Murty's
    rule where that does not help; dense or sparse LU

    For problems lcp, mlcp.

    Needs the entries of M; regular principal submatrices (M a P-matrix: guaranteed).

    Settings
    --------
    patience : int, default 10
        Changes of all at once without a new least number of wrong signs, before single changes
        begin.
    fallback : bool, default True
        Go on with single changes, which are finite for P-matrices; otherwise go on with all at
        once, and stop where they cycle.
    most_singles : int, default 0
        Single changes after which the method ends, as each costs a factorisation; 0: as many as it
        takes.

    References: JudicePires1994, Kostreva1978, Murty1974, BenGharbiaGilbert2012.
    """

    def __init__(
        self,
        *,
        patience: int = ...,
        fallback: bool = ...,
        most_singles: int = ...,
    ) -> None: ...

class Cadoux(Settings):
    """cadoux: Cadoux' approach: second-order cone programs of given sliding speeds, Newton on the speeds

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    inner : Literal['interior', 'clarabel', 'newton', 'projected_gradient'], default 'interior'
        The solver of the convex problem with given speeds.
    update : Literal['fixed_point', 'newton', 'anderson'], default 'newton'
        How the speeds are brought up to date.
    relaxation : float, default 1.0
        Fixed-point steps go this share of the way to F(s), in (0, 1].
    memory : int, default 5
        How many past steps Anderson's update combines, at least 1.
    inner_share : float, default 0.01
        The inner residual to reach, as a share of the last outer one, in (0, 1).
    inner_iterations : int, default 60
        At most this many inner iterations a step: factorisations, conic iterations or gradient
        steps.

    References: Cadoux2009, AcaryCadouxLemarechalMalick2011, Acary2018.
    """

    def __init__(
        self,
        *,
        inner: Literal['interior', 'clarabel', 'newton', 'projected_gradient'] = ...,
        update: Literal['fixed_point', 'newton', 'anderson'] = ...,
        relaxation: float = ...,
        memory: int = ...,
        inner_share: float = ...,
        inner_iterations: int = ...,
    ) -> None: ...

class Condense(Prefixed):
    """condense: global to local: forms W = H' M^-1 H and q, bilateral constraints eliminated

    For problems friction_global_2d, friction_global_3d, rolling_friction_global_3d.

    References: Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings] = "auto",
        **settings: object,
    ) -> None: ...

class ConvexRelaxation(Settings):
    """convex_relaxation: search for rest and interior point on the convex relaxation (s = 0), which is
    Coulomb's law only where nothing slides

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    convex_tolerance : float, default 1e-13
        The relative residual of the convex problem at which it has finished, positive.
    patience : int, default 30
        Steps without a smaller residual of the convex problem after which it gives up.

    References: EcksteinBertsekas1992, NesterovTodd1998, Mehrotra1992, Vandenberghe2010, Acary2018.
    """

    def __init__(
        self,
        *,
        convex_tolerance: float = ...,
        patience: int = ...,
    ) -> None: ...

class CrissCross(Settings):
    """criss_cross: least-index criss-cross: single and double principal pivots, for sufficient M; proves
    infeasibility

    For problems lcp, mlcp.

    Needs the entries of M; a sufficient M (PSD or P, for instance): guaranteed.

    Settings
    --------
    descending : bool, default False
        Take the largest index in place of the least: as good in theory.

    References: DenHertogRoosTerlaky1993, CsizmadiaIlles2006, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        descending: bool = ...,
    ) -> None: ...

class DeSaxce(Settings):
    """de_saxce: De Saxce-Feng fixed point (Uzawa) with a fixed step

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    rho : float, default 0.0
        The step in units of 1/w_c; 0 chooses the inverse of the largest eigenvalue.
    check_every : int, default 20
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: DeSaxceFeng1991, Acary2018.
    """

    def __init__(
        self,
        *,
        rho: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Enumeration(Settings):
    """enumeration: enumeration of complementary cones by branch and bound: any M of few variables, a
    solution or a proof that there is none

    For problems lcp, mlcp.

    Needs the entries of M; few complementary pairs (max_pairs).

    Settings
    --------
    max_pairs : int, default 20
        The most complementary pairs that are taken on, at most 40: the cases may be 2 to that
        power.
    batch : int, default 64
        Cases looked at in a step.

    References: CottlePangStone2009, Bland1977, Acary2018.
    """

    def __init__(
        self,
        *,
        max_pairs: int = ...,
        batch: int = ...,
    ) -> None: ...

class EnumerationExact(Settings):
    """enumeration_exact: enumeration of complementary cones in rational arithmetic: decides any problem of
    few variables, whatever its scaling and condition

    For problems lcp, mlcp, hlcp, box_lcp.

    Needs the entries of M; few complementary pairs (max_pairs).

    Settings
    --------
    max_pairs : int, default 20
        The most complementary pairs that are taken on, at most 40: the cases may be 2 to that
        power.

    References: CottlePangStone2009, Bareiss1968, Bland1977.
    """

    def __init__(
        self,
        *,
        max_pairs: int = ...,
    ) -> None: ...

class Extragradient(Settings):
    """extragradient: extragradient projection with a self-adaptive step

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d, vi.

    Settings
    --------
    rule : Literal['khobotov', 'solodov_tseng'], default 'khobotov'
        What a step length is measured by.
    accept : float, default 0.9
        Accept a step whose ratio is at most this, in (0, 1).
    grow_below : float, default 0.3
        Lengthen the next step after a ratio below this, in (0, accept).
    shrink : float, default 0.67
        The factor by which a step is shortened, in (0, 0.99); its inverse lengthens.
    check_every : int, default 20
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Korpelevich1976, Khobotov1987, SolodovTseng1996, Acary2018, FacchineiPang2003.
    """

    def __init__(
        self,
        *,
        rule: Literal['khobotov', 'solodov_tseng'] = ...,
        accept: float = ...,
        grow_below: float = ...,
        shrink: float = ...,
        check_every: int = ...,
    ) -> None: ...

class FacetInner(Prefixed):
    """facet_inner: contact to LCP: the disk of friction becomes an inscribed polygon; exact in the plane,
    an approximation in space

    For problems friction_local_2d, friction_local_3d.

    Settings
    --------
    facets : int, default 8
        The number ω of facets of each contact in space, at least 3; in the plane there are always
        2, and the law is exact.
    facet_angle : float, default 0.0
        The angle from the first tangent to the first vertex (inner) or the normal of the first
        facet (outer), rad.

    References: StewartTrinkle1996, AnitescuPotra1997, Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        *,
        facets: int = ...,
        facet_angle: float = ...,
        **settings: object,
    ) -> None: ...

class FacetOuter(Prefixed):
    """facet_outer: contact to MLCP: the disk of friction becomes a circumscribed polygon; exact in the
    plane, an approximation in space

    For problems friction_local_2d, friction_local_3d.

    Settings
    --------
    facets : int, default 8
        The number ω of facets of each contact in space, at least 3; in the plane there are always
        2, and the law is exact.
    facet_angle : float, default 0.0
        The angle from the first tangent to the first vertex (inner) or the normal of the first
        facet (outer), rad.

    References: Klarbring1986, Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        *,
        facets: int = ...,
        facet_angle: float = ...,
        **settings: object,
    ) -> None: ...

class FixedPoint(Settings):
    """fixed_point: fixed-point projection with a self-adaptive step

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d, vi.

    Settings
    --------
    rule : Literal['khobotov', 'solodov_tseng'], default 'khobotov'
        What a step length is measured by.
    accept : float, default 0.9
        Accept a step whose ratio is at most this, in (0, 1).
    grow_below : float, default 0.3
        Lengthen the next step after a ratio below this, in (0, accept).
    shrink : float, default 0.67
        The factor by which a step is shortened, in (0, 0.99); its inverse lengthens.
    check_every : int, default 20
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, Khobotov1987, SolodovTseng1996, HanLo2002, FacchineiPang2003.
    """

    def __init__(
        self,
        *,
        rule: Literal['khobotov', 'solodov_tseng'] = ...,
        accept: float = ...,
        grow_below: float = ...,
        shrink: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Glocker(Prefixed):
    """glocker: contact to MCP: Coulomb's law by Glocker's four saturations a contact, quadratic

    For problems friction_local_2d, friction_local_3d.

    References: Glocker1999, Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings] = "auto",
        **settings: object,
    ) -> None: ...

class Hyperplane(Settings):
    """hyperplane: hyperplane projection with a self-adaptive prediction

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d, vi.

    Settings
    --------
    normal : Literal['residual', 'field'], default 'residual'
        The normal of the hyperplane.
    gamma : float, default 1.5
        How far beyond (above 1) or short of (below 1) the hyperplane a step goes, in (0, 2).
    rule : Literal['khobotov', 'solodov_tseng'], default 'solodov_tseng'
        What the prediction's step length is measured by.
    accept : float, default 0.9
        Accept a prediction whose ratio is at most this, in (0, 1).
    grow_below : float, default 0.3
        Lengthen the next prediction after a ratio below this, in (0, accept).
    shrink : float, default 0.67
        The factor by which a prediction's step is shortened, in (0, 0.99); its inverse lengthens.
    check_every : int, default 20
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: SolodovTseng1996, SolodovSvaiter1999, AcaryBremondHuber2018, Acary2018,
    FacchineiPang2003.
    """

    def __init__(
        self,
        *,
        normal: Literal['residual', 'field'] = ...,
        gamma: float = ...,
        rule: Literal['khobotov', 'solodov_tseng'] = ...,
        accept: float = ...,
        grow_below: float = ...,
        shrink: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Ip(Settings):
    """ip: nonsmooth interior point: Mehrotra's predictor-corrector with Nesterov-Todd scaling on Coulomb's
    law itself

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    path : Literal['mehrotra', 'continuation'], default 'mehrotra'
        How the central path is followed.
    smoothing : float, default 0.0
        Smooths ‖u_T‖ to √(‖u_T‖² + δ²), δ this many times the complementarity; 0 for the exact law
        throughout.
    warm_margin : float, default 0.0
        Begin near the starting point, this far inside the cones in units of the free velocity; 0
        for a cold start.
    least_slope : float, default 1.0
        Where the boundary cuts a step short, it is computed anew with a part of the slope of ‖u_T‖,
        at least this, in (0, 1]; 1: always all. Not with continuation.
    patience : int, default 30
        Steps without a smaller residual after which it gives up.

    References: NesterovTodd1998, Mehrotra1992, TutuncuTohTodd2003, Keller1977.
    """

    def __init__(
        self,
        *,
        path: Literal['mehrotra', 'continuation'] = ...,
        smoothing: float = ...,
        warm_margin: float = ...,
        least_slope: float = ...,
        patience: int = ...,
    ) -> None: ...

class IpMehrotra(Settings):
    """ip_mehrotra: interior points in the wide neighbourhood: Mehrotra's predictor and corrector,
    infeasible start

    For problems lcp, mlcp, hlcp.

    Needs a monotone problem (of an LCP: M positive semidefinite) to be sure of its end.

    Settings
    --------
    epsilon : float, default 0.001
        ε of the neighbourhood `x_i s_i ≥ ε μ`, in (0, 0.5].
    start : float, default 1.0
        ξ of the start `x = s = ξ e`, in units in which the largest entries of M and q are about
        one.
    patience : int, default 30
        Iterations without progress after which it gives up, at least 1.

    References: Mehrotra1992, Wright1997, Acary2018, KojimaMegiddoNomaYoshise1991.
    """

    def __init__(
        self,
        *,
        epsilon: float = ...,
        start: float = ...,
        patience: int = ...,
    ) -> None: ...

class IpMty(Settings):
    """ip_mty: interior points in the narrow neighbourhood: predictor and corrector of Mizuno, Todd and Ye

    For problems lcp, mlcp, hlcp.

    Needs a monotone problem (of an LCP: M positive semidefinite) to be sure of its end.

    Settings
    --------
    theta : float, default 0.25
        θ of the inner neighbourhood, in (0, 0.25]; that of the predictor is 2θ.
    start : float, default 1.0
        ξ of the start `x = s = ξ e`, in units in which the largest entries of M and q are about
        one.
    patience : int, default 100
        Iterations without progress after which it gives up, at least 1.

    References: MizunoToddYe1993, Potra1996, Acary2018.
    """

    def __init__(
        self,
        *,
        theta: float = ...,
        start: float = ...,
        patience: int = ...,
    ) -> None: ...

class Keller(Settings):
    """keller: principal pivoting of Keller, Cottle and Dantzig: one negative variable at a time is driven
    to zero; proves infeasibility

    For problems lcp, mlcp.

    Needs the entries of M; a sufficient M (PSD or P, for instance): guaranteed.

    Settings
    --------
    least_index : bool, default False
        Distinguish the negative variable of least index, in place of the most negative one.

    References: Keller1973, CottleDantzig1968, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        least_index: bool = ...,
    ) -> None: ...

class Lemke(Settings):
    """lemke: Lemke: complementary pivoting on a factorised basis; decides solvability for copositive-plus
    M

    For problems lcp, mlcp.

    Needs the entries of M.

    Settings
    --------
    covering : Literal['auto', 'ones', 'scaled', 'row_norms', 'random'], default 'auto'
        The covering vector d.
    seed : int, default 1
        Seed of random covering vectors and of the perturbation.
    ties : Literal['auto', 'lexicographic', 'perturbed', 'rows', 'first'], default 'auto'
        How ties are broken.
    basis : Literal['auto', 'tableau', 'dense', 'sparse'], default 'auto'
        How the basis is kept.
    pivot_tolerance : float, default 1e-11
        A pivot below this is zero, in units of the largest entry of its column; in [0, 1e-3].
    renew_every : int, default 64
        Pivots between two factorisations of the basis, at least 1; not of the tableau.
    restarts : int, default 3
        After a ray that proves nothing: how many other covering vectors are tried.
    warm : bool, default True
        Whether a starting point other than zero gives the first basis.

    References: Acary2018, CottlePangStone2009, Lemke1965, Kostreva1979.
    """

    def __init__(
        self,
        *,
        covering: Literal['auto', 'ones', 'scaled', 'row_norms', 'random'] = ...,
        seed: int = ...,
        ties: Literal['auto', 'lexicographic', 'perturbed', 'rows', 'first'] = ...,
        basis: Literal['auto', 'tableau', 'dense', 'sparse'] = ...,
        pivot_tolerance: float = ...,
        renew_every: int = ...,
        restarts: int = ...,
        warm: bool = ...,
    ) -> None: ...

class LemkeHowson(Settings):
    """lemke_howson: Lemke–Howson: complementary pivots to an equilibrium of a bimatrix game

    For problems lcp, mlcp.

    Needs a bimatrix game: M = [0 K; Lᵀ 0], K, L ≥ 0, q < 0, in any order; or its mixed form with the
    players' values.

    Settings
    --------
    label : int, default 0
        The strategy whose label is dropped, counted over those of the row and then of the column
        player; where its path is spoiled by rounding the next ones follow.

    References: LemkeHowson1964, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        label: int = ...,
    ) -> None: ...

class Miles(Settings):
    """miles: Newton-Josephy: linear problems by pivots with implicit bounds, damped by the deviation (the
    code MILES)

    For problems mcp.

    Settings
    --------
    damping : float, default 0.5
        By what a step is shortened that does not decrease the deviation, in (0, 1).
    least_step : float, default 0.01
        The shortest step, taken whatever the deviation says, in (0, 1).
    patience : int, default 100
        Steps in which the deviation must have halved, else the method begins again.
    restarts : int, default 1
        How often it begins again.
    pivots : int, default 10000
        The most pivots of one linear problem.

    References: Rutherford1993, Josephy1979, Acary2018.
    """

    def __init__(
        self,
        *,
        damping: float = ...,
        least_step: float = ...,
        patience: int = ...,
        restarts: int = ...,
        pivots: int = ...,
    ) -> None: ...

class Mixed(Prefixed):
    """mixed: horizontal LCP to MLCP: s is a free variable

    For problems hlcp.

    References: Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        **settings: object,
    ) -> None: ...

class Mprgp(Settings):
    """mprgp: conjugate gradients on the face, gradient projections between faces; by products only

    For problems lcp, mlcp, box_lcp.

    Needs a symmetric positive semidefinite M.

    Settings
    --------
    gamma : float, default 2.0
        Γ: how large the gradient at the bounds may be, in units of that inside, before bounds are
        dropped; positive.
    expansion : float, default 1.9
        The length of the projected gradient step in units of 1/‖D⁻¹M‖, in (0, 2).
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: DostalSchoberl2005, Dostal2009.
    """

    def __init__(
        self,
        *,
        gamma: float = ...,
        expansion: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Multipliers(Prefixed):
    """multipliers: variational inequality over boxes and polyhedra to MCP: multipliers are variables

    For problems vi.

    References: FacchineiPang2003.
    """

    def __init__(
        self,
        solver: Union[str, Settings] = "auto",
        **settings: object,
    ) -> None: ...

class Murty(Settings):
    """murty: Murty's principal pivoting: the least index with a negative value changes sides

    For problems lcp, mlcp.

    Needs the entries of M; no zero on the tableau's diagonal (M a P-matrix: guaranteed).

    Settings
    --------
    descending : bool, default False
        Take the largest index in place of the least: as good in theory, and exponentially better or
        worse on an example.

    References: Acary2018, Murty1974, Murty1988, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        descending: bool = ...,
    ) -> None: ...

class Ncp(Prefixed):
    """ncp: contact to MCP: Coulomb's law by the speed of sliding, one multiplier a contact; with a root

    For problems friction_local_2d, friction_local_3d.

    References: Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings] = "auto",
        **settings: object,
    ) -> None: ...

class NeSqp(Settings):
    """ne_sqp: NE/SQP: Gauss-Newton on the natural residual inside the box, by convex quadratic programs

    For problems mcp.

    References: PangGabriel1993, Acary2018.
    """

    def __init__(self) -> None: ...

class NewtonAc(Settings):
    """newton_ac: semismooth Newton on the Alart-Curnier function

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: AlartCurnier1991, Acary2018, GoldsteinPrice1967, GrippoLamparielloLucidi1986.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonCm(Settings):
    """newton_cm: smoothing Newton on the Chen-Mangasarian class over the second-order cone

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    kernel : Literal['chks', 'neural_network'], default 'chks'
        The smoothing of the positive part.
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: ChenMangasarian1996, FukushimaLuoTseng2001, Acary2018.
    """

    def __init__(
        self,
        *,
        kernel: Literal['chks', 'neural_network'] = ...,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonEp(Settings):
    """newton_ep: Newton on the function of Evtushenko and Purtov, which is differentiable

    For problems mcp.

    Needs the entries of M.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'nonmonotone'
        How the line search accepts a step, on half the square of the function; `none` takes every
        full step and knows no other directions.
    restarts : int, default 4
        How often the method starts again elsewhere after it got stuck.
    seed : int, default 0
        Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are
        others.

    References: Acary2018, EvtushenkoPurtov1984.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        restarts: int = ...,
        seed: int = ...,
    ) -> None: ...

class NewtonFb(Settings):
    """newton_fb: semismooth Newton on the Fischer-Burmeister function over the second-order cone
    (friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d)
    newton_fb: semismooth Newton on the Fischer-Burmeister function; equalities in any number (lcp,
    mlcp, box_lcp, mcp)

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d, lcp,
    mlcp, box_lcp, mcp.

    Needs the entries of M.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default by kind
        How the line search accepts a step, on half the square of the function. Default 'armijo' for
        friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d; 'nonmonotone'
        for lcp, mlcp, box_lcp, mcp.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.
    restarts : int, default 4
        How often the method starts again elsewhere after it got stuck.
    seed : int, default 0
        Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are
        others.

    References: FukushimaLuoTseng2001, Acary2018, Fischer1992, DeLucaFacchineiKanzow1996.
    """

    def __init__(
        self,
        *,
        line_search: Optional[Literal['none', 'armijo', 'goldstein_price', 'nonmonotone']] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
        restarts: int = ...,
        seed: int = ...,
    ) -> None: ...

class NewtonFbSmooth(Settings):
    """newton_fb_smooth: smoothing Newton on the Fischer-Burmeister function over the second-order cone

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: FukushimaLuoTseng2001, Acary2018.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonHsw(Settings):
    """newton_hsw: semismooth Newton on the function of Hueber, Stadler and Wohlmuth

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    slip : Literal['modified', 'exact'], default 'modified'
        The derivative while sliding.
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: HueberStadlerWohlmuth2008.
    """

    def __init__(
        self,
        *,
        slip: Literal['modified', 'exact'] = ...,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonJm(Settings):
    """newton_jm: semismooth Newton on the Jean-Moreau function

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: AlartCurnier1991, Jean1999, Acary2018.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonMin(Settings):
    """newton_min: semismooth Newton on min(z, w), globalised by the Fischer-Burmeister merit

    For problems lcp, mlcp, box_lcp, mcp.

    Needs the entries of M.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'nonmonotone'
        How the line search accepts a step, on half the square of the function; `none` takes every
        full step and knows no other directions.
    restarts : int, default 4
        How often the method starts again elsewhere after it got stuck.
    seed : int, default 0
        Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are
        others.

    References: Acary2018, BenGharbiaGilbert2012, DeLucaFacchineiKanzow1996.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        restarts: int = ...,
        seed: int = ...,
    ) -> None: ...

class NewtonMinRho(Settings):
    """newton_min_rho: semismooth Newton on min(w, rho z) or min(z, rho w), globalised by the Fischer-
    Burmeister merit

    For problems mcp.

    Needs the entries of M.

    Settings
    --------
    rho : float, default 2.0
        The factor rho, positive; 1: the minimum itself.
    side : Literal['z', 'w'], default 'z'
        The argument of the minimum that rho multiplies.
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'nonmonotone'
        How the line search accepts a step, on half the square of the function; `none` takes every
        full step and knows no other directions.
    restarts : int, default 4
        How often the method starts again elsewhere after it got stuck.
    seed : int, default 0
        Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are
        others.

    References: Acary2018, DeLucaFacchineiKanzow1996.
    """

    def __init__(
        self,
        *,
        rho: float = ...,
        side: Literal['z', 'w'] = ...,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        restarts: int = ...,
        seed: int = ...,
    ) -> None: ...

class NewtonNm(Settings):
    """newton_nm: semismooth Newton on the natural map of the cone

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: AcaryBremondHuber2018, Acary2018.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonPfb(Settings):
    """newton_pfb: semismooth Newton on the penalised Fischer-Burmeister function

    For problems lcp, mlcp, box_lcp, mcp.

    Needs the entries of M.

    Settings
    --------
    lambda_ : float, default 0.8
        The weight of the Fischer-Burmeister function, in (0, 1]; the rest is the penalty's.
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'nonmonotone'
        How the line search accepts a step, on half the square of the function; `none` takes every
        full step and knows no other directions.
    restarts : int, default 4
        How often the method starts again elsewhere after it got stuck.
    seed : int, default 0
        Where it begins: 0 at the start given, other numbers elsewhere, and all their restarts are
        others.

    References: Acary2018, ChenChenKanzow2000.
    """

    def __init__(
        self,
        *,
        lambda_: float = ...,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        restarts: int = ...,
        seed: int = ...,
    ) -> None: ...

class NewtonPk(Settings):
    """newton_pk: semismooth Newton on the equations of Park and Kwak, with the sliding angle in space

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: ParkKwak1994, LeungChenChen1998, Acary2018.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class NewtonXsw(Settings):
    """newton_xsw: semismooth Newton on the direct equations of Xuewen, Soh and Wanji

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    line_search : Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'], default 'armijo'
        How the line search accepts a step, on half the square of the function.
    rho_rule : Literal['fixed', 'norm', 'spectral', 'adaptive'], default 'spectral'
        How rho of each contact follows from its block of W.
    rho : float, default 1.0
        The factor of the rule, positive: a pure number.
    warm_up : int, default 10
        Gauss-Seidel sweeps before the first Newton step.
    rescue : int, default 20
        Gauss-Seidel sweeps that take over for one step where Newton's fails, doubled up to 64-fold
        while that does not help; 0 gives up at once.
    smoothing : float, default 0.1
        Smoothed functions: the smoothing parameter is at most this fraction of the residual, at
        least 0. The others do not look at it.

    References: Acary2018.
    """

    def __init__(
        self,
        *,
        line_search: Literal['none', 'armijo', 'goldstein_price', 'nonmonotone'] = ...,
        rho_rule: Literal['fixed', 'norm', 'spectral', 'adaptive'] = ...,
        rho: float = ...,
        warm_up: int = ...,
        rescue: int = ...,
        smoothing: float = ...,
    ) -> None: ...

class Nsgs(Settings):
    """nsgs: nonsmooth block Gauss-Seidel over contacts and scalar rows with bounds, with a choice of local
    solvers

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    local : Literal['exact', 'quartic', 'newton_ac', 'newton_jm', 'projection', 'projection_iterated'], default 'exact'
        The one-contact solver. Contacts without friction and contacts in the plane have a closed
        form.
    local_tolerance : Literal['fixed', 'adaptive'], default 'fixed'
        How exactly the iterative local solvers (newton_*, projection_iterated) solve.
    omega : float, default 1.0
        Relaxation, in (0, 2); 1 is plain Gauss-Seidel. Below 1 helps flexible bodies, above 1
        rarely helps.
    omega_min : float, default 0.4
        Where 1000 sweeps bring no progress and go in circles, omega is multiplied by 0.8, down to
        this, in (0, 2). Not below omega: never.
    ordering : Literal['given', 'shuffled', 'fully_shuffled'], default 'given'
        The order of the contacts within a sweep.
    seed : int, default 0
        The seed of the shuffled orders.
    freeze_after : int, default 0
        Freeze a contact after this many visits in a row that moved it by less than a thousandth of
        the mean move of a contact in the last sweep; 0 never freezes.
    freeze_for : int, default 10
        The number of sweeps for which a frozen contact is passed over.
    anderson : int, default 0
        Anderson acceleration with at most this many differences; 0 for none. Helps on some slow
        problems and hurts on others.
    anderson_every : int, default 5
        Sweeps between two extrapolations of the Anderson acceleration.
    check_every : int, default 50
        Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one
        earlier.

    References: JourdanAlartJean1998, Jean1999, Acary2018, AcaryBremondHuber2018, DBB11, WalkerNi2011.
    """

    def __init__(
        self,
        *,
        local: Literal['exact', 'quartic', 'newton_ac', 'newton_jm', 'projection', 'projection_iterated'] = ...,
        local_tolerance: Literal['fixed', 'adaptive'] = ...,
        omega: float = ...,
        omega_min: float = ...,
        ordering: Literal['given', 'shuffled', 'fully_shuffled'] = ...,
        seed: int = ...,
        freeze_after: int = ...,
        freeze_for: int = ...,
        anderson: int = ...,
        anderson_every: int = ...,
        check_every: int = ...,
    ) -> None: ...

class NsgsColored(Settings):
    """nsgs_colored: nonsmooth block Gauss-Seidel on several threads, contacts by colour; the same bits for
    any number of threads

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    local : Literal['exact', 'quartic', 'newton_ac', 'newton_jm', 'projection', 'projection_iterated'], default 'exact'
        The one-contact solver. Contacts without friction and contacts in the plane have a closed
        form.
    threads : int, default 1
        The number of threads; 0 for one a core. It changes the time, not one bit of the result.
    serial_below : int, default 32
        Colours with fewer contacts than this are left to one thread.
    omega : float, default 1.0
        Relaxation, in (0, 2); 1 is plain Gauss-Seidel.
    omega_min : float, default 0.4
        Where 1000 sweeps bring no progress and go in circles, omega is multiplied by 0.8, down to
        this, in (0, 2). Not below omega: never.
    check_every : int, default 50
        Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one
        earlier.

    References: JourdanAlartJean1998, Acary2018, JonesPlassmann1993.
    """

    def __init__(
        self,
        *,
        local: Literal['exact', 'quartic', 'newton_ac', 'newton_jm', 'projection', 'projection_iterated'] = ...,
        threads: int = ...,
        serial_below: int = ...,
        omega: float = ...,
        omega_min: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Panagiotopoulos(Settings):
    """panagiotopoulos: Panagiotopoulos' alternation of a normal and a tangential convex problem

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    inner : Literal['sweeps', 'projected_gradient', 'active_set'], default 'sweeps'
        The solver of the two convex problems.
    inner_share : float, default 0.1
        The inner residual to reach, as a share of the last outer one, in (0, 1).
    inner_iterations : int, default 50
        At most this many sweeps, gradient steps or factorisations for each of the two problems.

    References: Panagiotopoulos1975, Acary2018, AcaryBremondHuber2018.
    """

    def __init__(
        self,
        *,
        inner: Literal['sweeps', 'projected_gradient', 'active_set'] = ...,
        inner_share: float = ...,
        inner_iterations: int = ...,
    ) -> None: ...

class Path(Settings):
    """path: Newton on the normal map along arcs of its linearisation, non-monotone, with crash, proximal
    term and restarts (the code PATH)

    For problems mcp.

    Settings
    --------
    crash : Literal['automatic', 'always', 'never'], default 'automatic'
        When projected Newton steps that look for the active set come first.
    merit : Literal['fischer', 'penalised', 'normal'], default 'fischer'
        The merit that a step must decrease.
    memory : int, default 10
        Of how many merits the largest is the reference of the search; 1: monotone.
    kappa : float, default 20.0
        The reference at the beginning, in units of the first merit, at least 1.
    lemke_start : Literal['automatic', 'first', 'always', 'never'], default 'automatic'
        When linear problems begin on Lemke's ray rather than in the basis of the point.
    proximal : float, default 0.0
        The proximal term λ at the beginning; 0: only where the first matrix is singular.
    watchdog : bool, default True
        Whether full steps are taken for a while whatever the merit says.
    restarts : int, default 5
        How often it begins again with other options, at most 5.
    pivots : int, default 1000
        The most pivots of one linear problem.

    References: Robinson1992, Ralph1994, DirkseFerris1995, DirkseFerris1997, FerrisMunson1999,
    Munson2002, Acary2018.
    """

    def __init__(
        self,
        *,
        crash: Literal['automatic', 'always', 'never'] = ...,
        merit: Literal['fischer', 'penalised', 'normal'] = ...,
        memory: int = ...,
        kappa: float = ...,
        lemke_start: Literal['automatic', 'first', 'always', 'never'] = ...,
        proximal: float = ...,
        watchdog: bool = ...,
        restarts: int = ...,
        pivots: int = ...,
    ) -> None: ...

class Pgs(Settings):
    """pgs: projected Gauss-Seidel: each variable in turn solves its own row

    For problems lcp, mlcp, box_lcp.

    Needs the entries of M; a positive diagonal of M.

    Settings
    --------
    direction : Literal['forward', 'symmetric'], default 'forward'
        The order of the visits.
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, Cryer1971, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        direction: Literal['forward', 'symmetric'] = ...,
        check_every: int = ...,
    ) -> None: ...

class Presolve(Prefixed):
    """presolve: MCP to MCP: variables that are known or that an equation defines are put where they are
    used, rows that say nothing go

    For problems mcp.

    References: FerrisMunson2001.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        **settings: object,
    ) -> None: ...

class ProjectedJacobi(Settings):
    """projected_jacobi: projected Jacobi: one projected step of every variable at once

    For problems lcp, mlcp, box_lcp.

    Needs a positive diagonal of M.

    Settings
    --------
    omega : float, default 1.0
        Relaxation: the step in units of 1/M_ii, in (0, 2).
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        omega: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Proxi(Settings):
    """proxi: nonsmooth Newton on the natural residual, with proximal problems to leave where it stalls

    For problems mcp.

    Settings
    --------
    crash : bool, default True
        Whether projected Newton steps that look for the active set come first.

    References: Billups1995, BillupsFerris1997, Acary2018.
    """

    def __init__(
        self,
        *,
        crash: bool = ...,
    ) -> None: ...

class Proximal(Prefixed):
    """proximal: proximal point: the solver works on problems with W + alpha w in place of W

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d.

    Settings
    --------
    prox_rule : Literal['fixed', 'residual', 'success'], default 'success'
        How alpha changes from one inner problem to the next.
    prox_alpha : float, default 1.0
        The first alpha, in units of w_c; the only one where prox_rule is fixed.
    prox_alpha_min : float, default 1e-08
        No rule lets alpha fall below it.
    prox_sigma : float, default 5.0
        sigma of `alpha = sigma e^nu`, e the relative residual.
    prox_nu : float, default 1.0
        nu of `alpha = sigma e^nu`.
    prox_tolerance : float, default 0.1
        An inner problem is solved when its residual is below this part of the residual that the
        outer loop began it with.
    prox_steps : int, default 500
        At most this many inner steps for an inner problem.

    References: Rockafellar1976, AcaryBremondHuber2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        *,
        prox_rule: Literal['fixed', 'residual', 'success'] = ...,
        prox_alpha: float = ...,
        prox_alpha_min: float = ...,
        prox_sigma: float = ...,
        prox_nu: float = ...,
        prox_tolerance: float = ...,
        prox_steps: int = ...,
        **settings: object,
    ) -> None: ...

class Psor(Settings):
    """psor: projected successive over-relaxation: Gauss-Seidel sweeps with one projection a contact
    (friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d)
    psor: projected Gauss-Seidel with over-relaxation, whose factor may follow the observed rate (lcp,
    mlcp, box_lcp)

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d,
    rolling_friction_local_3d, rolling_friction_global_3d, lcp, mlcp, box_lcp.

    Needs the entries of M; a positive diagonal of M.

    Settings
    --------
    omega : float, default 1.3
        Over-relaxation: the step in units of `1/|W_cc|`, in (0, 2).
    ordering : Literal['given', 'shuffled', 'fully_shuffled'], default 'given'
        The order of the contacts within a sweep.
    seed : int, default 0
        The seed of the shuffled orders.
    check_every : int, default 50
        Sweeps between two evaluations of the true residual, unless the cheap estimate asks for one
        earlier.
    adapt : bool, default True
        Whether omega follows the observed rate of convergence, with direction=forward; pays for
        matrices like those of grids.
    direction : Literal['forward', 'symmetric'], default 'forward'
        The order of the visits.
    patience : int, default 0
        End where the observed rate of convergence promises more sweeps than this, with
        direction=forward; 0: never. Without adapt it is read after a quarter of them.

    References: Cryer1971, AcaryBremondHuber2018, Acary2018, CottlePangStone2009, HagemanYoung1981.
    """

    def __init__(
        self,
        *,
        omega: float = ...,
        ordering: Literal['given', 'shuffled', 'fully_shuffled'] = ...,
        seed: int = ...,
        check_every: int = ...,
        adapt: bool = ...,
        direction: Literal['forward', 'symmetric'] = ...,
        patience: int = ...,
    ) -> None: ...

class Qp(Settings):
    """qp: the convex quadratic program behind the problem, through Clarabel, polished

    For problems lcp, mlcp, box_lcp.

    Needs M positive semidefinite; symmetric where variables have two bounds.

    Settings
    --------
    form : Literal['auto', 'energy', 'gap'], default 'auto'
        Which program: energy needs a symmetric M, gap needs variables that are free or nonnegative.
    inner_tolerance : float, default 1e-09
        Clarabel's tolerance on gap and feasibility, in (0, 1e-3].
    inner_iterations : int, default 200
        Clarabel's iterations at most, at least 1.

    References: GoulartChen2024, CottlePangStone2009, Acary2018.
    """

    def __init__(
        self,
        *,
        form: Literal['auto', 'energy', 'gap'] = ...,
        inner_tolerance: float = ...,
        inner_iterations: int = ...,
    ) -> None: ...

class Qpcomp(Settings):
    """qpcomp: NE/SQP, with proximal problems to leave where it stalls

    For problems mcp.

    Settings
    --------
    crash : bool, default False
        Whether projected Newton steps that look for the active set come first; the published method
        has none.

    References: BillupsFerris1997, PangGabriel1993, Acary2018.
    """

    def __init__(
        self,
        *,
        crash: bool = ...,
    ) -> None: ...

class Reduce(Prefixed):
    """reduce: MLCP to LCP: the free variables eliminated, M = B - D A^-1 C, where A is invertible

    For problems mlcp.

    References: Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        **settings: object,
    ) -> None: ...

class Rpgs(Settings):
    """rpgs: projected Gauss-Seidel inside a proximal loop, for zeros on the diagonal

    For problems lcp, mlcp, box_lcp.

    Needs the entries of M; a nonnegative diagonal of M.

    Settings
    --------
    rho : float, default 1.0
        The regularisation in units of the balanced row sums of |M|, positive. With adapt, the first
        one.
    adapt : bool, default True
        Whether rho follows the number of sweeps that the inner problems take.
    fraction : float, default 0.2
        The inner residual, in units of the proximal move, at which the centre moves; in (0, 1).
    direction : Literal['forward', 'symmetric'], default 'forward'
        The order of the visits.
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, Rockafellar1976.
    """

    def __init__(
        self,
        *,
        rho: float = ...,
        adapt: bool = ...,
        fraction: float = ...,
        direction: Literal['forward', 'symmetric'] = ...,
        check_every: int = ...,
    ) -> None: ...

class Rpsor(Settings):
    """rpsor: PSOR inside a proximal loop, for zeros on the diagonal

    For problems lcp, mlcp, box_lcp.

    Needs the entries of M; a nonnegative diagonal of M.

    Settings
    --------
    omega : float, default 1.2
        Relaxation of the sweeps, in (0, 2).
    rho : float, default 1.0
        The regularisation in units of the balanced row sums of |M|, positive. With adapt, the first
        one.
    adapt : bool, default True
        Whether rho follows the number of sweeps that the inner problems take.
    fraction : float, default 0.2
        The inner residual, in units of the proximal move, at which the centre moves; in (0, 1).
    direction : Literal['forward', 'symmetric'], default 'forward'
        The order of the visits.
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, Rockafellar1976.
    """

    def __init__(
        self,
        *,
        omega: float = ...,
        rho: float = ...,
        adapt: bool = ...,
        fraction: float = ...,
        direction: Literal['forward', 'symmetric'] = ...,
        check_every: int = ...,
    ) -> None: ...

class Semicomp(Settings):
    """semicomp: semismooth Newton on the Fischer-Burmeister function, with proximal problems to leave
    where it stalls

    For problems mcp.

    Settings
    --------
    crash : bool, default True
        Whether projected Newton steps that look for the active set come first.

    References: Billups1995, BillupsFerris1997, DeLucaFacchineiKanzow1996, Acary2018.
    """

    def __init__(
        self,
        *,
        crash: bool = ...,
    ) -> None: ...

class Semismooth(Settings):
    """semismooth: semismooth Newton on the penalised Fischer-Burmeister function, with crash and restarts
    (the code SEMI)

    For problems mcp.

    Settings
    --------
    lambda_ : float, default 0.8
        The weight of the Fischer-Burmeister function, in (0, 1]; the rest is the penalty's.
    memory : int, default 4
        Of how many merits the largest is the reference of the search; 1: monotone.
    crash : bool, default True
        Whether projected Newton steps that look for the active set come first.
    restarts : bool, default True
        Whether it begins again with other options where it stalls.
    seed : int, default 0
        Where it begins: 0 at the start, other numbers at points around it, ever farther with the
        number modulo 4.

    References: DeLucaFacchineiKanzow1996, ChenChenKanzow2000, Munson2002, Acary2018.
    """

    def __init__(
        self,
        *,
        lambda_: float = ...,
        memory: int = ...,
        crash: bool = ...,
        restarts: bool = ...,
        seed: int = ...,
    ) -> None: ...

class Smooth(Settings):
    """smooth: Chen's and Mangasarian's smoothing of the natural residual, one Newton step for each
    parameter

    For problems mcp.

    Settings
    --------
    beta : float, default 1.0
        The first β, in units of one over those of x.
    crash : bool, default True
        Whether projected Newton steps that look for the active set come first.

    References: ChenMangasarian1996, Acary2018.
    """

    def __init__(
        self,
        *,
        beta: float = ...,
        crash: bool = ...,
    ) -> None: ...

class Split(Prefixed):
    """split: box LCP to MLCP: bounds by shifts, second bounds by multipliers

    For problems box_lcp.

    References: Acary2018.
    """

    def __init__(
        self,
        solver: Union[str, Settings],
        **settings: object,
    ) -> None: ...

class SplittingLs(Settings):
    """splitting_ls: a PSOR or Jacobi sweep gives the direction, an exact line search on the energy the
    step

    For problems lcp, mlcp, box_lcp.

    Needs the entries of M; a symmetric M; a positive diagonal of M.

    Settings
    --------
    sweep : Literal['psor', 'jacobi'], default 'psor'
        Where the direction comes from.
    omega : float, default 1.3
        Relaxation of the sweep, in (0, 2).
    check_every : int, default 50
        Steps between two evaluations of the true residual, unless the estimate asks for one
        earlier.

    References: Acary2018, CottlePangStone2009.
    """

    def __init__(
        self,
        *,
        sweep: Literal['psor', 'jacobi'] = ...,
        omega: float = ...,
        check_every: int = ...,
    ) -> None: ...

class Tnnmg(Settings):
    """tnnmg: truncated nonsmooth Newton multigrid: Gauss-Seidel finds the face, aggregation multigrid
    solves on it

    For problems lcp, mlcp, box_lcp.

    Needs the entries of M; a symmetric M; a positive diagonal of M.

    Settings
    --------
    sweeps : int, default 4
        Sweeps of projected Gauss-Seidel a step, in alternating directions.
    reduction : float, default 0.1
        The linear system is solved to this part of its residual, in (0, 1).
    gradients : int, default 10
        At most this many steps of conjugate gradients for that.
    cascade : bool, default True
        Whether a start at zero is replaced by that of a cascade through the levels.

    References: GraserKornhuber2009, Kornhuber1994, Notay2010, NotayVassilevski2008.
    """

    def __init__(
        self,
        *,
        sweeps: int = ...,
        reduction: float = ...,
        gradients: int = ...,
        cascade: bool = ...,
    ) -> None: ...

class Tresca(Settings):
    """tresca: Tresca fixed point (Haslinger): convex problems over cylinders of given thresholds

    For problems friction_local_2d, friction_local_3d, friction_global_2d, friction_global_3d.

    Settings
    --------
    inner : Literal['projected_gradient', 'active_set', 'conic'], default 'active_set'
        The solver of the convex problem with given thresholds.
    relaxation : float, default 1.0
        The thresholds move by this share of the way to mu r_N, in (0, 1].
    anderson : int, default 0
        How many past steps (at most 50) Anderson's acceleration of the thresholds combines; 0 is
        the plain fixed point.
    inner_share : float, default 0.1
        The inner residual to reach, as a share of the last outer one, in (0, 1).
    inner_iterations : int, default 100
        At most this many inner iterations a step: gradient steps, factorisations or conic
        iterations.

    References: HaslingerDostalKucera2002, Acary2018, AcaryBremondHuber2018.
    """

    def __init__(
        self,
        *,
        inner: Literal['projected_gradient', 'active_set', 'conic'] = ...,
        relaxation: float = ...,
        anderson: int = ...,
        inner_share: float = ...,
        inner_iterations: int = ...,
    ) -> None: ...
