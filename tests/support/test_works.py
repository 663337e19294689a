"""`Work` coroutines: run together, translated, answered."""

from printhammer.support.threads import Work, answered, together, translated

ASKED: list[list[int]] = []


def squares(numbers: list[int]) -> list[int]:
    ASKED.append(numbers)
    return [number * number for number in numbers]


def sum_of(first: int, last: int, size: int) -> Work[int, int, int]:
    """Sum squares, requested in batches of `size`."""
    total = 0
    for begin in range(first, last, size):
        answers = yield list(range(begin, min(begin + size, last)))
        total += sum(answers)
    return total


def test_a_work_is_answered_question_by_question() -> None:
    ASKED.clear()
    assert answered(sum_of(0, 5, 2), squares) == 30
    assert ASKED == [[0, 1], [2, 3], [4]]
    assert answered(sum_of(0, 0, 2), squares) == 0


def test_works_together_ask_at_once_until_each_is_over() -> None:
    ASKED.clear()
    works = [sum_of(0, 1, 1), sum_of(10, 10, 1), sum_of(1, 4, 2)]
    assert answered(together(works), squares) == [0, 0, 14]
    assert ASKED == [[0, 1, 2], [3]]
    assert answered(together([]), squares) == []
    nested = together([together([sum_of(0, 3, 3)]), together([sum_of(3, 5, 1)])])
    assert answered(nested, squares) == [[5], [25]]


def test_a_work_is_translated_into_questions_of_another_kind() -> None:
    """Sums of squares by works that ask for single ones."""

    def one_by_one(numbers: list[str]) -> Work[int, int, list[int]]:
        answers = []
        for number in numbers:
            answers += yield [int(number)]
        return answers

    def ask() -> Work[str, int, int]:
        first = yield ["3", "4"]
        second = yield ["5"]
        return sum(first) - sum(second)

    ASKED.clear()
    assert answered(translated(ask(), one_by_one), squares) == 0
    assert ASKED == [[3], [4], [5]]
