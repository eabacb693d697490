"""All that a worker needs before its first job; importing it takes a second or so.

The process that workers are forks of imports it, so that they share what it has loaded.
"""

import logging

from vsep_app.jobs.warmup import separate_one_frame
from vsep_app.pages.compare import tasks as compare_tasks
from vsep_app.pages.recording import tasks as recording_tasks
from vsep_app.pages.street import tasks as street_tasks

# Jobs are functions of these.
TASKS = compare_tasks, recording_tasks, street_tasks

try:
    separate_one_frame()
except Exception as problem:  # the jobs may do all the same
    logging.getLogger(__name__).error("a worker could not prepare", exc_info=problem)
