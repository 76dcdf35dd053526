-- Which objects pass the reset check through an exemption alone: a start that has the energy to topple them, or a fall that no hinge brakes?
SELECT
    count(DISTINCT i.asset_id) FILTER (i.reason LIKE '%which a rise of%') AS topple,
    count(DISTINCT i.asset_id) FILTER (i.reason LIKE '%cannot brake this fall%') AS slip,
    count(DISTINCT i.asset_id) AS objects
FROM interactions i JOIN assets a USING (asset_id)
WHERE a.status = 'ok' AND i.test = 'reset' AND i.passed
    AND (i.reason LIKE '%which a rise of%' OR i.reason LIKE '%cannot brake this fall%')
